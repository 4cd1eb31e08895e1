"""The story of the demo: compare, diagnose, add, and the error falls."""

from dataclasses import replace

from fitting.cli.run import CommandRun
from fitting.comparison.compare import compare
from fitting.report.page.page import write_page
from fitting.report.results import comparison_result, diagnosis_result, fit_result, steps_result
from fitting.report.text.changes import change_text
from fitting.report.text.comparison import judgement, kind_text, place_text
from fitting.report.text.diagnosis import diagnosis_report, verdict_text
from fitting.report.text.layout import line
from fitting.report.text.study import steps_report
from fitting.study.changing import change, with_added
from fitting.study.diagnosing import diagnose_task
from fitting.study.preview import p_value_with
from fitting.study.stages import Stage
from fitting.study.task import fit_task


def demonstrate(run: CommandRun) -> None:
    """Tell the story, and write it as a page into the current folder."""
    task = run.task
    with run.progress("1 of 3: fitting the baseline and comparing"):
        first = compare(fit_task(task), task.experiments)
    run.print([line("COMPARE", judgement(first), "bold"), line("", f"Worst at {place_text(first)}.")])
    run.print([line("", kind_text(first))])
    with run.progress("2 of 3: diagnosing") as progress:
        found, compared = diagnose_task(task, None, progress)
    run.print(diagnosis_report(found, compared.unit, compared))
    added = found.explanations[0] if found.explanations else found.leading.effects[:1] if found.leading else ()
    begun = Stage("baseline", first.rmse, found.held_out_rmse, found.verdict, first, diagnosis=found,
                  p_value=found.p_value)  # fmt: skip
    stages, last, final = [begun], first, task
    if added:
        final, by = with_added(task, added)
        with run.progress("3 of 3: adding it and fitting again") as progress:
            done = change(task, final, by, progress)
        # both errors on held-out runs of all samples, as the sentence says them: a diagnosis looks at fewer
        stages = [replace(begun, held_out_rmse=done.stages[0].held_out_rmse)]
        stages.append(replace(done.stages[-1], p_value=p_value_with(found, tuple(added))))
        last = done.comparison
        run.print([line("ADD", change_text(done, last.unit), "bold"), *steps_report(stages, last.unit)])
    write_page(str(run.request.html), final, last, found, stages)
    run.print([line("WRITTEN", f"{run.request.html}: {verdict_text(found)}")])
    run.print([line("NEXT", f"mckibben demo {task.experiments[0].folder.name} --reveal")])
    run.write(
        {**comparison_result(last), **diagnosis_result(found, compared), **steps_result(stages)}
        | {"fit": fit_result(last.fit)}
    )
    run.end(last.fit.converged)
