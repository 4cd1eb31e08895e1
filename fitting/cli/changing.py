"""`mckibben add` and `mckibben drop`: change the model, print, save, write."""

from collections.abc import Callable, Sequence

from fitting.cli.run import CommandRun
from fitting.cli.saving import save
from fitting.report.page.page import write_page
from fitting.report.text.attempts import held_text
from fitting.report.text.changes import change_result, change_text
from fitting.report.text.fit import fit_report
from fitting.report.text.layout import line, lines
from fitting.report.text.next_step import after_change
from fitting.report.text.study import steps_report
from fitting.study.changing import Difference, change
from fitting.study.task import Task

STILL = "Is anything still missing?"
NOT_TAKEN = (
    "nothing: the larger model ended above the smaller one, which it contains; its search was caught on its way. "
    "Begin elsewhere, with --set or more --starts"
)


def change_model(
    run: CommandRun, names: Sequence[str], how: Callable[[Task, Sequence[str]], tuple[Task, Difference]]
) -> None:
    """The whole command: change, print, save, write."""
    changed, by = how(run.task, names)
    with run.progress("fitting") as progress:
        found = change(run.task, changed, by, progress)
    unit = found.comparison.unit
    held = [text for stage in found.stages for text in held_text(stage.held)]
    run.print([line("RESULT", change_text(found, unit), "bold"), *steps_report(found.stages, unit)])
    run.print([*lines("SIZES", held), *fit_report(found.after)])
    after = after_change(run.request.data_again, run.request.save)
    run.print([line("SAVED", NOT_TAKEN, "yellow")] if found.worse else save(run, found.after, after))
    run.write(change_result(found))
    if run.request.html:
        following = None if found.worse else (STILL, after)
        write_page(run.request.html, found.task, found.comparison, stages=found.stages, following=following)
    run.end(found.before.converged and found.after.converged)
