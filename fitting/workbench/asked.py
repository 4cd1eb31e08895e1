"""What else one may ask in the workbench: what to measure next, what the data leave open, which muscle to build."""

import dataclasses
import tempfile
from pathlib import Path

from fitting.errors import InputError
from fitting.progress import Progress
from fitting.report.page.parts import as_text
from fitting.report.text.names import Names
from fitting.workbench.session import Answer, Session, fit_of, in_own_units, told, with_last

NEXT, POSTERIOR, DESIGN = "What to measure next", "What the data leave open", "Design"


@in_own_units
def plan(session: Session, progress: Progress) -> Session:
    """Which recording would tell apart what the diagnosis leaves tied."""
    from fitting.report.text.plan import plan_report
    from fitting.study.plan import plan_of

    step = session.last
    if step.diagnosis is None:
        raise InputError("there is no diagnosis yet", cure="run it first: the plan separates what it leaves tied")
    plan = plan_of(step.task, step.diagnosis, progress)
    words = as_text(plan_report(plan, session.request.model_file), Names(step.task.library))
    return told(session, Answer(NEXT, words))


@in_own_units
def sample_posterior(session: Session, progress: Progress, seconds: float = 60.0) -> Session:
    """What the data leave open of the parameters, sampled for at most so long."""
    from fitting.posterior.record import describe
    from fitting.posterior.sample import sample
    from fitting.report.pictures.figures import as_svg
    from fitting.report.pictures.posterior import pairs, predicted

    step, fit = session.last, fit_of(session)
    found = sample(
        fit,
        step.task.experiments,
        seed=step.task.seed,
        limit_s=seconds,
        progress=lambda done, worth: progress(f"{done} steps, {worth:.0f} independent samples", 0.5),
    )
    drawn = (
        (
            "Each parameter, and every two against each other: dark places hold half of the draws, dark and light ones "
            "90 %.",
            pairs(found),
        ),
        ("Measured minus predicted, in the band that should hold 90 % of the readings.", predicted(found)),
    )
    pictures = tuple((caption, as_svg(figure, f"posterior{k}")) for k, (caption, figure) in enumerate(drawn))
    answered = told(session, Answer(POSTERIOR, describe(found), pictures))
    return with_last(answered, dataclasses.replace(answered.last, posterior=found))


def find_design(spec: str, progress: Progress) -> Answer:
    """The muscle that does best what a design file asks for, and a drawing of it to scale."""
    from fitting.designs.file import read_design
    from fitting.report.pictures.design import stroke_of, to_scale
    from fitting.report.pictures.figures import as_svg
    from fitting.report.text.design import describe
    from mckibben_jax.design.best import design

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "design.toml"
        path.write_text(spec, encoding="utf-8")
        progress("designing", 0.1)
        try:
            task = read_design(path)
        except InputError as error:
            error.file = None  # the user has not named it
            raise
    found = design(task)
    pressure, stroke = stroke_of(task, found)
    drawing = as_svg(to_scale(found.muscle, max(stroke, 0.0), pressure), "design")
    return Answer(DESIGN, describe(found), (("To scale: at rest, and at the end of its stroke.", drawing),))
