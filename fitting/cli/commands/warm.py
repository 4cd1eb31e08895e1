"""`mckibben warm`: compile ahead what a first diagnosis needs."""

import time
from typing import Any

import click

from fitting.cli.options import Command, output_options
from fitting.cli.run import errors_for_machines, progress_bar
from fitting.progress import unwatched

USUAL = ("muscle_a", "martens2017_dmsp10")  # shipped: loops, and a map of points


@click.command("warm", cls=Command)
@click.argument("data", nargs=-1, metavar="[DATASET]...")
@output_options
def command(data: tuple[str, ...], **options: Any) -> None:
    """Compile ahead what a first diagnosis needs; installers do this once, so that nobody waits for it later.

    Without DATASET for a usual recording of loops and for a map of points: others whose runs are about as long use the
    same programs. Name a data set of your own to compile for recordings like it. Programs are kept on disk.
    """
    from fitting.cli.output import output
    from fitting.compiled.prepare import prepare
    from fitting.compiled.store import content, folder
    from fitting.report.text.warm import warm_report, warm_result
    from fitting.shipped import example_data
    from fitting.study.request import Request
    from fitting.study.task import task_of

    prepare()
    with errors_for_machines(options["json"]):
        place = folder()
        sets = data or tuple(str(example_data(name)) for name in USUAL)
        tasks = [task_of(Request(data=(path,), baseline=True, seed=options["seed"])) for path in sets]
    seconds = {}
    with progress_bar("compiling", options["quiet"]) as progress:
        for number, (path, task) in enumerate(zip(sets, tasks, strict=True)):
            progress(f"compiling for {task.experiments[0].name}", number / len(tasks))
            begun = time.monotonic()
            _first_diagnosis(task)
            seconds[path] = time.monotonic() - begun
    kept = content(place)
    output(options, "mckibben warm", warm_report(seconds, kept), warm_result(seconds, kept))


def _first_diagnosis(task: Any) -> None:
    """All that `compare` and `diagnose` compute."""
    from fitting.comparison.compare import compare
    from fitting.study.diagnosing import diagnose_task
    from fitting.study.task import fit_task

    compare(fit_task(task), task.experiments)
    diagnose_task(task, None, unwatched)
