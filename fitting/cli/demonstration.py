"""The story of the demo: compare, diagnose, add, and the error falls."""

from fitting.cli.run import Study
from fitting.comparison.compare import compare
from fitting.report.page.page import write_page
from fitting.report.results import comparison_result, diagnosis_result, fit_result, steps_result
from fitting.report.text.changes import change_text
from fitting.report.text.comparison import judgement, kind_text
from fitting.report.text.diagnosis import diagnosis_report, verdict_text
from fitting.report.text.layout import line
from fitting.report.text.study import steps_report
from fitting.study.changing import change, with_added
from fitting.study.diagnosing import diagnosed
from fitting.study.stages import Stage
from fitting.study.task import fitted


def demonstrate(study: Study) -> None:
    """Tell the story, and write it as a page into the current folder."""
    task = study.task
    with study.working("1 of 3: fitting the baseline and comparing"):
        first = compare(fitted(task), task.experiments)
    study.print([line("COMPARE", judgement(first), "bold"), line("", f"Worst at {first.worst}.")])
    study.print([line("", kind_text(first))])
    with study.working("2 of 3: diagnosing") as progress:
        found, compared = diagnosed(task, None, progress)
    study.print(diagnosis_report(found, compared.unit))
    added = found.explanations[0] if found.explanations else found.leading.effects[:1] if found.leading else ()
    begun = Stage("baseline", first.rmse, found.held_out_rmse, found.verdict, first.fit.residual)
    stages, last, final = [begun], first, task
    if added:
        final, words = with_added(task, added)
        with study.working("3 of 3: adding it and fitting again") as progress:
            done = change(task, final, words, progress)
        stages.append(done.stages[-1])
        last = done.comparison
        study.print([line("ADD", change_text(done, last.unit), "bold"), *steps_report(stages, last.unit)])
    write_page(str(study.asked.html), final, last, found, stages)
    study.print([line("WRITTEN", f"{study.asked.html}: {verdict_text(found)}")])
    study.print([line("NEXT", f"mckibben demo {task.experiments[0].folder.name} --reveal")])
    study.write(
        {**comparison_result(last), **diagnosis_result(found, compared), **steps_result(stages)}
        | {"fit": fit_result(last.fit)}
    )
    study.end(last.fit.converged)
