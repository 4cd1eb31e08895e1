"""`mckibben posterior`: what the data leave open."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.interrupts import stopped
from fitting.cli.options import Command, data_argument, fit_options, output_options, study_options
from fitting.cli.run import CommandRun, check_place, check_places, start
from fitting.study.request import CHAINS

if TYPE_CHECKING:
    from fitting.least_squares.record import Fit
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
def command(**options: Any) -> None:
    """Sample the parameters around the fit (emcee), and say whether the result can be trusted.

    Stopped or killed, the same command goes on where it was. Priors are those of muscle.toml (+/-) and of model.toml.
    """
    check_places(options["netcdf"])
    run = start(options)
    from fitting.posterior.record import describe, save, to_json
    from fitting.study.task import fit_task
    from fitting.writing import write_whole

    with run.progress("fitting") as progress:
        fit = fit_task(run.task)
        place = _place_of_chains(run, options)
        with _what_is_kept(place):
            found = _sampled(run, fit, options, progress, place)
    run.print([describe(found)])
    run.write(to_json(found))
    if run.request.html:
        from fitting.report.page.posterior import write_posterior

        write_posterior(run.request.html, run.task, found)
    if options["netcdf"]:
        write_whole(options["netcdf"], lambda new: save(found, new))
    run.end(fit.converged)
    run.end(found.settled, "the draws are too few, or the chains do not agree")


@contextmanager
def _what_is_kept(chains: str | None) -> Iterator[None]:
    """Whoever stops the sampling learns what is kept of it."""
    try:
        yield
    except KeyboardInterrupt:
        if chains and os.path.exists(chains):
            stopped(f"The chains so far are kept in {chains}: the same command goes on from there.")
        stopped("No chains are kept.")


def _sampled(
    run: CommandRun, fit: "Fit", options: dict[str, Any], progress: "Progress", chains: str | None
) -> "Posterior":
    """The posterior by the sampler that was asked for."""
    from fitting.units import to_si

    task, seconds = run.task, to_si(options["limit"], "s", "--limit")
    common: dict[str, Any] = {"seed": task.seed, "priors": task.priors}
    if options["quick"]:
        from fitting.posterior.quick import quick_look

        progress("quick look", 0.5)
        return quick_look(fit, task.experiments, **common)
    if options["sampler"] == "nuts":
        from fitting.posterior.nuts import sample_nuts

        return sample_nuts(fit, task.experiments, limit_s=seconds, progress=progress, **common)
    from fitting.posterior.sample import sample

    return sample(
        fit,
        task.experiments,
        **common,
        max_steps=options["steps"],
        limit_s=seconds,
        chains=chains,
        again=options["again"],
        progress=lambda done, worth: progress(f"{done} steps, {worth:.0f} effective samples", done / options["steps"]),
    )


def _place_of_chains(run: CommandRun, options: dict[str, Any]) -> str | None:
    """The file of chains of emcee; none beside data that may not be written to, which is said."""
    if options["no_chains"] or options["quick"] or options["sampler"] != "emcee":
        return None
    if options["chains"]:
        check_place(options["chains"])
        return options["chains"]
    folder = run.task.experiments[0].folder
    if os.access(folder, os.W_OK):
        return str(folder / CHAINS)
    run.print([f"The chains are not kept: {folder} may not be written to (--chains FILE names another place)."])
    return None
