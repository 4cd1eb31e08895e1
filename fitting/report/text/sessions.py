"""Evidence over sessions in words: what is excluded, what still stands, and from which session on."""

from collections.abc import Sequence
from typing import Any

from rich.console import RenderableType

from fitting import showing
from fitting.diagnosis.flip_groups import rests_on_in_words
from fitting.evidence.sessions import GrowingEvidence, Weighed
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.names import listed, mark, marked
from fitting.report.text.next_step import shell_words
from fitting.showing import counted

MANY = 1e6  # to one: beyond it nobody wants the number
FEW = 0.01
EXCLUDED_SHOWN = 5
MEANS = (
    "Each session was fitted by itself, and what the signs of its loops say was multiplied. Of a hundred right models "
    "at most one ever reaches {enough:.0f} to 1, however many sessions follow and whenever you stop: record on, and "
    "look as often as you like. That holds if the instruments are the same in all sessions and err as stated or "
    "presumed."
)


def sessions_report(found: GrowingEvidence, data: Sequence[str] = ()) -> list[RenderableType]:
    """The verdict, a table of models by session, and what it means; `data` are the sessions as they were given."""
    shown: list[RenderableType] = [line("EVIDENCE", verdict_text(found), "bold")]
    stands = standing_text(found)
    shown += [line("STANDS", stands)] if stands else []
    shown += [spaced(_table(found)), ""]
    how = [line("HOW", MEANS.format(enough=found.enough)), *lines("RESTS ON", _rests_on(found))]
    return [*shown, *how, line("NEXT", next_text(found, data))]


def _rests_on(found: GrowingEvidence) -> list[str]:
    """What the scores of each session rest on; once where it is the same."""
    words = [rests_on_in_words(each) for each in found.rests_on]
    if len(set(words)) == 1:
        return [words[0] + " in each session" * (len(words) > 1)]
    return [f"{name}: {each}" for name, each in zip(found.sessions, words, strict=True)]


def headline(found: GrowingEvidence) -> str:
    """The answer in one short sentence."""
    after = f"after {counted(len(found.sessions), 'session')}"
    if not found.is_lacking:
        return f"Nothing is shown to be missing {after}."
    if not found.standing:
        return f"Something is missing {after}, and no single effect of the library explains it."
    names = listed([name for each in found.standing for name in each.added])
    return f"Missing {after}: {'one of ' * (len(found.standing) > 1)}{names}."


def verdict_text(found: GrowingEvidence) -> str:
    """Whether something is missing from the model, and how sure that is."""
    largest, by = max(found.as_it_is.evidence), found.as_it_is.excluded_by(found.enough)
    after = counted(len(found.sessions), "session")
    if by is None:
        return (
            f"Nothing is shown to be missing after {after}: the evidence against the model is "
            f"{odds(found.as_it_is.evidence[-1])} to 1, and {found.enough:.0f} to 1 is asked for."
        )
    points = f" It is largest along {mark(found.as_it_is.points_at)}." if found.as_it_is.points_at else ""
    since = f", enough since session {by + 1} ({found.sessions[by]})" if len(found.sessions) > 1 else ""
    return f"Something is missing from the model: evidence of {odds(largest)} to 1 against it{since}.{points}"


def standing_text(found: GrowingEvidence) -> str:
    """Which models with one effect more still stand, where the model itself does not."""
    if not found.is_lacking:
        return ""
    stand, out = [each.added for each in found.standing], len(found.singles) - len(found.standing)
    excluded = f" {counted(out, 'other effect')} excluded for good." if out else ""
    if not stand:
        return f"No effect of the library explains it alone: all {out} are excluded."
    if len(stand) == 1:
        return f"With {marked(stand[0], ' + ')} the model still stands, and with nothing else.{excluded}"
    names = listed([name for added in stand for name in added])
    return f"With one of {counted(len(stand), 'effect')} the model still stands: {names}.{excluded}"


def next_text(found: GrowingEvidence, data: Sequence[str] = ()) -> str:
    """What to do now, with the command where it is one."""
    folders = shell_words(data)
    if found.is_lacking and len(found.standing) == 1:
        command = " ".join(filter(None, ("mckibben add", folders, *found.standing[0].added)))
        return f"Add it: '{command}'. Later sessions may still exclude it; give them behind these."
    if found.is_lacking and found.standing:
        command = f"mckibben plan {folders}".strip()
        return f"'{command}' names the recording that tells these apart; give it behind these sessions."
    if found.is_lacking:
        command = f"mckibben discover {folders}".strip()
        return f"'{command}' tries several effects at once; weigh the model that it ends with."
    return "Record another session, and give its folder behind these: the evidence goes on from here."


def odds(value: float) -> str:
    """How many to one, as people read it."""
    if value >= MANY:
        return "over a million"
    if value < FEW:
        return "below 0.01"
    return f"{value:.2g}" if value < 10 else f"{float(f'{value:.3g}'):,.0f}"


def _table(found: GrowingEvidence) -> Any:
    """The model as it is, what stands, and the best of what is excluded; the earliest sessions go first."""
    count = len(found.sessions)
    table = columns("evidence against the model", *found.sessions, "RMS error", spare=tuple(range(1, count)))
    excluded = [each for each in found.singles if each not in found.standing]
    rows = [found.as_it_is, *(found.standing if found.is_lacking else ()), *excluded[:EXCLUDED_SHOWN]]
    for each in rows:
        out = each.excluded_by(found.enough) is not None
        table.add_row(
            _called(each), *map(odds, each.evidence), showing.show(each.rmse, "N"), style="dim" if out else ""
        )
    return table


def _called(each: Weighed) -> str:
    return f"with {marked(each.added, ' + ')}" if each.added else "as it is"


def sessions_result(found: GrowingEvidence) -> dict[str, Any]:
    """For machines."""
    return {
        "enough": found.enough,
        "sessions": list(found.sessions),
        "something_missing": found.is_lacking,
        "standing": [list(each.added) for each in found.standing] if found.is_lacking else [],
        "models": [_model(each, found) for each in (found.as_it_is, *found.singles)],
    }


def _model(each: Weighed, found: GrowingEvidence) -> dict[str, Any]:
    by = each.excluded_by(found.enough)
    return {
        "added": list(each.added),
        "evidence": list(each.evidence),
        "excluded_by": None if by is None else found.sessions[by],
        "rmse_N": each.rmse,
        "points_at": each.points_at,
    }
