"""`mckibben discover`: diagnose and add, until nothing more can be said."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.interrupts import stopped
from fitting.cli.options import (
    Command,
    candidate_options,
    data_argument,
    fit_options,
    output_options,
    save_options,
    study_options,
)
from fitting.cli.run import CommandRun, start

if TYPE_CHECKING:
    from fitting.study.stages import Stage


@click.command("discover", cls=Command)
@data_argument
@study_options
@candidate_options
@fit_options
@save_options
@click.option(
    "--enough",
    default="1 %",
    show_default=True,
    metavar="SHARE",
    help="Of full scale: what you can live with. What is missing and small is looked into only where it is more.",
)
@output_options
def command(**options: Any) -> None:
    """Diagnose, add one effect, and again, until nothing more can be said.

    An effect that leads is added whatever the verdict. A step is kept if it lowers the error on held-out runs by more
    than its standard error and by a tenth, and raises no error; if no parameter ends at its bound and no value is
    smaller than its error by the readings alone (instruments and stated sizes make the errors of the last table
    larger). Where a step would deny a stated size, all of them stay within two standard errors of what was stated; so
    too where the model denies one and only then something can be added. What is not kept is said. In the end, what a
    model that lacks nothing does not need any more is dropped.
    """
    enough = _share(options["enough"])
    run = start(options)
    from fitting.cli.saving import save
    from fitting.report.page.page import write_page
    from fitting.report.results import diagnosis_result, fit_result, steps_result
    from fitting.report.text.changes import on_motions_result, on_motions_text
    from fitting.report.text.comparison import judgement
    from fitting.report.text.diagnosis import diagnosis_report, effect_set
    from fitting.report.text.fit import fit_report
    from fitting.report.text.layout import line, lines
    from fitting.report.text.next_step import after_discovery
    from fitting.report.text.path import blamed_on_the_way, path_result, path_texts
    from fitting.report.text.practice import practice_result, practice_text, small_rest_texts
    from fitting.report.text.stages import fall_text
    from fitting.report.text.study import step_report, steps_report
    from fitting.study.diagnosing import all_candidates, candidates_of, in_newtons
    from fitting.study.discovering import discover_task, on_motions
    from fitting.study.practice import practice

    candidates = candidates_of(run.task, run.request.candidates, run.request.rivals) or all_candidates(run.task)
    made: list[Stage] = []
    with _last_step_is_saved(run, made), run.progress("diagnosing") as progress:

        def shown(stage: "Stage") -> None:
            made.append(stage)
            with progress.aside():
                run.print(step_report(stage))

        found = discover_task(in_newtons(run.task), candidates, progress, shown, enough)
        motions = on_motions(run.task, found, progress)
    compared, stages = found.comparison, found.stages
    unit = compared.unit
    fell = [fall_text(stages, compared.rmse, unit)] if len(stages) > 1 else []
    words = " ".join([*fell, judgement(compared)])
    use = practice(stages, compared, enough)
    left = small_rest_texts(found.diagnosis, enough, run.request.data_again)
    run.print([line("RESULT", practice_text(use), "bold"), *lines("FINER", left), line("ERROR", words)])
    run.print([line("MODEL NOW", effect_set(found.task.names)), *lines("CHECK", blamed_on_the_way(stages))])
    run.print([*steps_report(stages, unit), *lines("PATH", path_texts(stages)), line("", "")])
    run.print([*diagnosis_report(found.diagnosis, unit, compared), *fit_report(compared.fit)])
    final = compared.fit if motions is None else motions.after
    if motions is not None:
        run.print([line("MOTION", on_motions_text(motions), "bold"), *fit_report(final)])
    unsure = motions is not None and not motions.confirmed
    saved = ("--model", run.request.save) if run.request.save else ()
    after = after_discovery(found.diagnosis, (*run.request.data_again, *saved))
    run.print([line("SAVED", "nothing: the motions do not confirm it")] if unsure else save(run, final, after.command))
    result = {
        **diagnosis_result(found.diagnosis, compared),
        **fit_result(compared.fit),
        **steps_result(stages),
        **path_result(stages),
        **practice_result(use),
    }
    run.write(result | on_motions_result(motions))
    if run.request.html:
        write_page(
            run.request.html, found.task, compared, found.diagnosis, stages, enough=enough,
            following=None if unsure else after,
        )  # fmt: skip
    run.end(final.converged)


@contextmanager
def _last_step_is_saved(run: CommandRun, made: "Sequence[Stage]") -> Iterator[None]:
    """Whoever stops it keeps the model of the last step that was printed.

    Where no force was measured the motions would still have to confirm it: nothing is saved then.
    """
    try:
        yield
    except KeyboardInterrupt:
        from fitting.cli.saving import save
        from fitting.recordings.records import force_was_measured

        last = made[-1].comparison if len(made) > 1 and force_was_measured(run.task.experiments) else None
        if last is None:
            stopped("No step is kept.")
        run.print(save(run, last.fit))
        stopped("The last step is kept.")


def _share(text: str) -> float:
    """A share of full scale; InputError where it is none."""
    from fitting.errors import InputError
    from fitting.units import to_si

    share = to_si(text, "1", "--enough")
    if not 0 < share < 1:
        raise InputError("--enough is no share of full scale", value=text, cure="write for example '1 %' or 0.01")
    return share
