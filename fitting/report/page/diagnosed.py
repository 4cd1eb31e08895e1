"""The parts of the page about diagnoses, and how they follow the switch between its models."""

from collections.abc import Sequence
from dataclasses import replace

from fitting.report.page.diagnosis import alike, effects, limits
from fitting.report.page.models import ShownModel, short_name
from fitting.report.page.names import PageNames
from fitting.report.page.parts import Section
from fitting.report.text.diagnosis import left_missing_text


def of_diagnoses(models: Sequence[ShownModel], names: PageNames) -> list[Section]:
    """What each diagnosis found.

    Of several diagnoses each shows with its own model. A single one always shows: its titles name its model, and for
    every other model it says which one it is about, and what is known of the one that was chosen.
    """
    diagnosed = [model for model in models if model.diagnosis is not None]
    found = list[Section]()
    for model in diagnosed:
        parts = _of_diagnosis(model, models, names)
        if len(diagnosed) > 1:
            found += [replace(part, model=model.number) for part in parts]
        else:
            found += [replace(part, title=_titled(part.title, model, len(models))) for part in parts]
            found[0] = replace(found[0], said=_said(model, models))
    return found


def _of_diagnosis(model: ShownModel, models: Sequence[ShownModel], names: PageNames) -> list[Section]:
    d = model.diagnosis
    assert d is not None  # the caller has looked
    bars = _bars_of(model, models) if len(models) > 1 else {}
    parts = [limits(d), effects(d, model.comparison, names, bars), alike(d, names, model.number)]
    return [part for part in parts if part is not None]


def _bars_of(model: ShownModel, models: Sequence[ShownModel]) -> dict[frozenset[str], str]:
    """Which bars of the evidence are models on the switch: by the effects that they have more, the button of each."""
    return {_added(later, model): f"step{later.number}" for later in models[model.number :]}


def _added(later: ShownModel, model: ShownModel) -> frozenset[str]:
    """The effects that were added from one model to a later one."""
    return frozenset(name for stage in later.stages[model.number + 1 :] for name in stage.added)


def _titled(title: str, model: ShownModel, count: int) -> str:
    """A title with the name of its model, where the page has several."""
    return f"Model '{short_name(model, count)}': {title[:1].lower()}{title[1:]}" if count > 1 else title


def _said(model: ShownModel, models: Sequence[ShownModel]) -> tuple[tuple[int, str], ...]:
    """For each of the other models, where one is chosen: that this is not about it, and its own test."""
    d, count = model.diagnosis, len(models)
    assert d is not None  # the caller has looked
    return tuple(
        (
            other.number,
            f"You have chosen the model '{short_name(other, count)}'. This section is about the model "
            f"'{short_name(model, count)}', which was diagnosed. " + left_missing_text(other.p_value, d.level),
        )
        for other in models
        if other is not model
    )
