"""`mckibben hill`: is it a Hill muscle?"""

from typing import Any

import click

from fitting.cli.options import (
    Command,
    data_argument,
    fit_options,
    output_options,
    shooting_option,
    study_options,
)
from fitting.cli.run import start


@click.command("hill", cls=Command)
@data_argument
@study_options
@fit_options
@shooting_option
@click.option("--no-motion", is_flag=True, help="Only the curve of speeds; fit no model to the recorded motion.")
@output_options
def command(no_motion: bool, **options: Any) -> None:
    """Speed over load from quick releases: Hill's a/F0 and b, and whether dry friction alone gives the same curve."""
    run = start(options)
    from fitting.hill.hill import by_pressure, curves
    from fitting.hill.motion import motions
    from fitting.report.text.hill import hill_report, hill_result

    with run.progress("reading speeds, fitting motions"):
        found = curves(run.task.experiments)
        moved = None if no_motion else motions(run.task, found)
    shown = hill_report(found, moved, by_pressure(run.task.experiments))
    run.print(shown)
    run.write(hill_result(found, moved))
    if run.request.html:
        from fitting.report.page.parts import Section, write_text_page
        from fitting.report.pictures.figures import as_svg
        from fitting.report.pictures.hill import speed_over_load

        picture = Section("Steady speed over load", picture=as_svg(speed_over_load(found), "hill"))
        write_text_page(run.request.html, "mckibben hill", shown, [picture])
    run.end(moved is None or (moved.dry.converged and moved.viscous.converged))
