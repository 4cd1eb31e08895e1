"""`mckibben posterior`: what the data leave open."""

import os
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import CHAINS, Command, data_argument, fit_options, output_options, study_options
from fitting.cli.run import Study, begin, check_place, check_places

if TYPE_CHECKING:
    from fitting.least_squares.fit import Fit
    from fitting.posterior.sample import Posterior
    from fitting.progress import Progress

SAMPLERS = ("emcee", "nuts")


@click.command("posterior", cls=Command)
@data_argument
@study_options
@fit_options
@click.option("--quick", is_flag=True, help="A quick look: importance sampling around the mode, with its own check.")
@click.option("--sampler", type=click.Choice(SAMPLERS), default="emcee", show_default=True, help="Who samples.")
@click.option("--steps", default=20_000, show_default=True, metavar="N", help="Steps of the chains at most.")
@click.option("--limit", default="10 min", show_default=True, metavar="TIME", help="Time at most, for this call.")
@click.option("--chains", metavar="FILE", help=f"Keeps the chains as they grow; default: {CHAINS} beside the data.")
@click.option("--no-chains", is_flag=True, help="Keep no chains: a run that is stopped is lost.")
@click.option("--again", is_flag=True, help="Begin anew, whatever the file of chains holds.")
@click.option("--netcdf", metavar="FILE", help="Write the draws as netCDF, for arviz and xarray.")
@output_options
def command(**given: Any) -> None:
    """Sample the parameters around the fit (emcee), and say whether the result can be trusted.

    Stopped or killed, the same command goes on where it was. Priors are those of muscle.toml (+/-) and of model.toml.
    """
    check_places(given["netcdf"])
    study = begin(given)
    from fitting.posterior.record import describe, save, to_json
    from fitting.study.task import fitted
    from fitting.writing import write_whole

    with study.working("fitting") as progress:
        fit = fitted(study.task)
        found = _sampled(study, fit, given, progress)
    study.print([describe(found)])
    study.write(to_json(found))
    if study.asked.html:
        from fitting.report.page.posterior import write_posterior

        write_posterior(study.asked.html, study.task, found)
    if given["netcdf"]:
        write_whole(given["netcdf"], lambda new: save(found, new))
    study.end(fit.converged and found.settled)


def _sampled(study: Study, fit: "Fit", given: dict[str, Any], progress: "Progress") -> "Posterior":
    """The posterior by the sampler that was asked for."""
    from fitting.units import to_si

    task, seconds = study.task, to_si(given["limit"], "s", "--limit")
    common: dict[str, Any] = {"seed": task.seed, "priors": task.priors}
    if given["quick"]:
        from fitting.posterior.quick import quick_look

        progress("quick look", 0.5)
        return quick_look(fit, task.experiments, **common)
    if given["sampler"] == "nuts":
        from fitting.posterior.nuts import sample_nuts

        return sample_nuts(fit, task.experiments, limit_s=seconds, progress=progress, **common)
    from fitting.posterior.sample import sample

    return sample(
        fit,
        task.experiments,
        **common,
        max_steps=given["steps"],
        limit_s=seconds,
        chains=_place_of_chains(study, given),
        again=given["again"],
        progress=lambda done, worth: progress(f"{done} steps, {worth:.0f} effective samples", done / given["steps"]),
    )


def _place_of_chains(study: Study, given: dict[str, Any]) -> str | None:
    """The file of chains; none beside data that may not be written to, which is said."""
    if given["no_chains"]:
        return None
    if given["chains"]:
        check_place(given["chains"])
        return given["chains"]
    folder = study.task.experiments[0].folder
    if os.access(folder, os.W_OK):
        return str(folder / CHAINS)
    study.print([f"The chains are not kept: {folder} may not be written to (--chains FILE names another place)."])
    return None
