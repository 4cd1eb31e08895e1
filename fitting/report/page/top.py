"""The top of the page: of each model the verdict, the sentences and the numbers below it, and what to type next."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fitting.comparison.compare import Comparison
from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.recordings.records import NoiseSource
from fitting.report.page.diagnosis import Meaning, meanings
from fitting.report.page.models import ShownModel
from fitting.report.page.similar_groups import named_by
from fitting.report.settings import ERROR_TEXT
from fitting.report.text.amounts import amount, percent
from fitting.report.text.attempts import attempt_text
from fitting.report.text.comparison import fails, judgement, place_text
from fitting.report.text.diagnosis import effect_set, headline_text, leading_text, undecided_text
from fitting.report.text.fit import fit_warnings
from fitting.report.text.instrument_answers import instrument_texts
from fitting.report.text.next_step import after_comparison, after_diagnosis
from fitting.report.text.practice import explained_text, left_text, practice_text
from fitting.report.text.stages import added_text, fall_text
from fitting.report.text.untried import untried_texts
from fitting.report.text.warnings import comparison_warnings
from fitting.study.practice import practice
from fitting.study.preview import suggested
from fitting.study.stages import Stage, added_by
from fitting.study.task import Task

UNNAMED = frozenset({Verdict.NOT_IN_LIBRARY, Verdict.INCONCLUSIVE})  # what is left has no name


@dataclass(frozen=True)
class Head:
    """What the top of the page says of one model."""

    number: int
    effects: str
    verdict: str
    meanings: tuple[Meaning, ...]  # what the effects are that the headline or the verdict names
    lead: tuple[str, ...]
    cards: tuple[tuple[str, str], ...]  # numbers as text, and what each is
    warnings: tuple[str, ...]


def head(model: ShownModel, models: Sequence[ShownModel], task: Task, enough: float) -> Head:
    """The top of the page for one of its models; `enough` is the share of full scale that may be left."""
    return Head(
        model.number,
        effect_set(model.effects),
        verdict(model, models, enough),
        tuple(meanings(_in_headline(model, models, enough), task)),
        tuple(lead(model, models, enough)),
        tuple(cards(model)),
        (*fit_warnings(model.comparison.fit), *comparison_warnings(model.comparison)),
    )


def verdict(model: ShownModel, models: Sequence[ShownModel], enough: float) -> str:
    """The headline: the verdict of the model's own diagnosis, what was added if that is the answer, or what became of
    the diagnosis before it."""
    d, added = model.diagnosis, _added(model.stages)
    if d is None:
        return _undiagnosed(model, _diagnosed(model, models), added)
    if _was_missing(d, model):
        return _found(d)
    said = headline_text(d)
    if not added:
        return said
    if _is_explained(model, models, enough):
        return f"{explained_text(practice(model.stages, model.comparison, enough))}."
    before = "With" if _is_of_its_own(model, models) else "Before"
    return f"{before} {added} added: {said[:1].lower()}{said[1:]}"


def _in_headline(model: ShownModel, models: Sequence[ShownModel], enough: float) -> Sequence[str]:
    """The effects that a reader meets first: what was added where that is the answer, else what a diagnosis names."""
    if _is_explained(model, models, enough):
        return added_by(model.stages)
    diagnosed = _diagnosed(model, models)
    return () if diagnosed is None else named_by(diagnosed)


def _is_of_its_own(model: ShownModel, models: Sequence[ShownModel]) -> bool:
    """Whether the verdict is on this model: a single one may carry that on one before it, of which no more is known."""
    return bool(model.stage.verdict) or len(models) > 1


def _is_explained(model: ShownModel, models: Sequence[ShownModel], enough: float) -> bool:
    """Whether what was added is the answer: nothing more is missing, or what is left is little and has no name.

    Then it stands first how much is explained, and what may hide in the rest comes below.
    """
    d = model.diagnosis
    if d is None or _was_missing(d, model) or not (added_by(model.stages) and _is_of_its_own(model, models)):
        return False
    if d.verdict in NOTHING_MISSING:
        return not d.is_strained
    return d.verdict in UNNAMED and practice(model.stages, model.comparison, enough).is_enough


def _undiagnosed(model: ShownModel, before: Diagnosis | None, added: str) -> str:
    """A model that was not diagnosed itself: it has what was missing, or it is told by its error."""
    if before is not None and _was_missing(before, model) and not model.is_preview:
        return _found(before)
    said = judgement(model.comparison)
    return f"With {added} added: {said[:1].lower()}{said[1:]}" if added else said


def _found(d: Diagnosis) -> str:
    names = d.explanations[0]
    was, now = ("was", "is") if len(names) == 1 else ("were", "are")
    return f"{effect_set(names)} {was} missing, and {now} in the model now."


def _was_missing(d: Diagnosis, model: ShownModel) -> bool:
    return d.verdict == Verdict.MISSING and any({*names} <= {*model.effects} for names in d.explanations)


def _added(stages: Sequence[Stage]) -> str:
    """What the last model has that the first had not, and what of the first gave way to it."""
    here, own = set(added_by(stages)), {name for stage in stages for name in stage.added}
    steps = [replace(stage, dropped=tuple(name for name in stage.dropped if name not in own)) for stage in stages[1:]]
    return " and ".join(added_text(stage) for stage in steps if here & {*stage.added})


def _diagnosed(model: ShownModel, models: Sequence[ShownModel]) -> Diagnosis | None:
    """The model's own diagnosis, else the last one before it."""
    known = [each.diagnosis for each in models[: model.number + 1] if each.diagnosis is not None]
    return known[-1] if known else None


def next_command(model: ShownModel, models: Sequence[ShownModel], task: Task) -> tuple[str, str] | None:
    """What to do next with the model that the page is of, and the command for it."""
    folders = [str(e.folder) for e in task.experiments]
    d = _diagnosed(model, models)
    tried = [set(attempt.effects) for attempt in model.stage.attempts]
    if d is not None and set(suggested(d)) in tried:  # a discovery has tried it, and did not keep it
        return None
    if d is None:
        command = after_comparison(model.comparison, folders)
        return ("Which effect is missing?", command) if command else None
    return None if any({*names} <= {*task.names} for names in d.explanations) else after_diagnosis(d, folders)


def lead(model: ShownModel, models: Sequence[ShownModel], enough: float) -> list[str]:
    """The sentences below the verdict."""
    c, stages = model.comparison, model.stages
    said = _of_diagnosis(model.diagnosis, c) if model.diagnosis is not None else _of_test(model, models)
    if len(stages) < 2:
        return said
    fell = fall_text(stages, stages[-1].rmse, c.unit)
    use, d = practice(stages, c, enough), model.diagnosis
    if d is not None and _is_explained(model, models, enough):
        return [f"{left_text(use)} {fell}", *_refused(model), headline_text(d), *said]
    return [practice_text(use), *_refused(model), *said, fell]


def _refused(model: ShownModel) -> list[str]:
    """Why what the verdict names was not added, though it was tried."""
    if model.diagnosis is None:
        return []
    named = [{*names} for names in model.diagnosis.explanations]
    return [attempt_text(a, model.comparison.unit) for a in model.stage.attempts if {*a.effects} in named]


def _of_diagnosis(d: Diagnosis, c: Comparison) -> list[str]:
    place = f"It fails most at {place_text(c)}." if fails(c) else ""
    texts = (undecided_text(d), leading_text(d), *untried_texts(d), *instrument_texts(d), judgement(c), place)
    return [text for text in texts if text]


def _of_test(model: ShownModel, models: Sequence[ShownModel]) -> list[str]:
    """What the test says of a model that was fitted in the diagnosis of the one before it."""
    before = _diagnosed(model, models)
    if before is None:
        return []
    said = [] if model.is_preview else [judgement(model.comparison)]  # a preview has it as its headline
    if model.p_value is None:
        return said
    what = "finds nothing missing any more" if model.p_value >= before.level else "still finds something missing"
    return [*said, f"In this model the sign-flip test {what} (p = {model.p_value:.2g}, level {before.level:g})."]


def _basis_of_noise(c: Comparison) -> str:
    """What the noise is of; a presumed one is no measurement, and readers would take it for one."""
    if c.noise_floor is not None:
        return "repeated loops"
    return "presumed: state it" if {*c.noise_sources} == {NoiseSource.ASSUMED} else "one reading"


def cards(model: ShownModel) -> list[tuple[str, str]]:
    """The numbers on top, each with what it is; all are of this one model."""
    c, stage, p_value = model.comparison, model.stage, model.p_value
    shown = [
        (amount(c.rmse, c.unit), "error, root mean square"),
        (percent(c.share), f"of full scale, {amount(c.full_scale, c.unit)}"),
        (amount(c.floor, c.unit), f"noise, {_basis_of_noise(c)}"),
    ]
    if stage.held_out_rmse is not None:
        shown.insert(1, (amount(stage.held_out_rmse, c.unit), "error on held-out runs"))
    shown += [
        (f"± {amount(band.half_width, 'N')}", f"holds 9 readings of 10 of a new {band.test} run")
        for band in c.bands
        if band.known
    ]
    if c.fingerprint.odd_share is not None and c.rmse > ERROR_TEXT.near_floor * c.floor:
        shown.append((percent(c.fingerprint.odd_share), "of the misfit is odd: changes sign with the direction"))
    tested = "-" if p_value is None else f"{p_value:.2g}"
    return [*shown, (tested, "p in the test that nothing is missing" + (": not tested" if p_value is None else ""))]
