"""`mckibben posterior`: what the data leave open."""

from typing import Any

import click

from fitting.options import Command, data_argument, fit_options, output_options, study_options
from fitting.study import begin


@click.command("posterior", cls=Command)
@data_argument
@study_options
@fit_options
@click.option("--steps", default=20_000, show_default=True, metavar="N", help="Steps of the chains at most.")
@click.option("--limit", default="10 min", show_default=True, metavar="TIME", help="Time at most.")
@click.option("--chains", metavar="FILE", help="Write the chains as netCDF.")
@output_options
def command(steps: int, limit: str, chains: str | None, **given: Any) -> None:
    """Sample the parameters around the fit (emcee), and say whether the result can be trusted."""
    study = begin(given)
    from fitting.page import write_words
    from fitting.posterior import sample
    from fitting.posterior_record import describe, save, to_json
    from fitting.task import fitted
    from fitting.units import to_si

    seconds = to_si(limit, "s", "--limit")
    with study.working("fitting") as told:
        fit = fitted(study.task)
        found = sample(
            fit,
            study.task.experiments,
            seed=study.task.seed,
            max_steps=steps,
            limit_s=seconds,
            progress=lambda done, worth: told(f"{done} steps, {worth:.0f} independent samples", done / steps),
        )
    words = describe(found)
    study.write(to_json(found))
    if study.asked.html:
        write_words(study.asked.html, "Posterior", [words])
    study.print([words])
    if chains:
        save(found, chains)
    study.end(fit.converged)
