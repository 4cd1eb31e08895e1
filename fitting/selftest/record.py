"""What a self-test says: immutable records, and the file in which they are kept as they come."""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from fitting.errors import InputError


class Outcome(StrEnum):
    """What a diagnosis made of an effect that was hidden."""

    NAMED = "named"  # it alone
    ONE_OF = "one of"  # among others that these data cannot tell from it
    MISTAKEN = "taken for another"
    UNKNOWN = "not in the library"
    NOT_SEEN = "not seen"


SEEN = (Outcome.NAMED, Outcome.ONE_OF)


@dataclass(frozen=True)
class Trial:
    """One diagnosis of one rehearsed recording. Values in SI, by full name."""

    effect: str  # that was hidden; empty where nothing was
    times: float  # its detection limit
    size: float  # N rms that it leaves
    values: dict[str, float]
    verdict: str
    explanations: tuple[tuple[str, ...], ...]
    outcome: Outcome
    limits: dict[str, float | None] = field(default_factory=dict)  # N rms, of every effect; where nothing was hidden

    @classmethod
    def read(cls, told: dict[str, Any]) -> "Trial":
        """From plain values."""
        explanations = tuple(tuple(names) for names in told["explanations"])
        return cls(**{**told, "explanations": explanations, "outcome": Outcome(told["outcome"])})


@dataclass(frozen=True)
class Sought:
    """What came of one effect: its detection limit (N rms), its trials by their size, or why it was not hidden."""

    effect: str
    limit: float | None
    trials: tuple[Trial, ...] = ()
    why_not: str = ""

    @property
    def named_from(self) -> float | None:
        """The smallest size (N rms) that was named, with every larger one; None where none was."""
        return self._from((Outcome.NAMED,))

    @property
    def seen_from(self) -> float | None:
        """The same where it is enough to be one of several."""
        return self._from(SEEN)

    @property
    def taken_for(self) -> tuple[tuple[str, ...], ...]:
        """All that it was taken for, where it was not among what was named."""
        wrong = [names for each in self.trials if each.outcome is Outcome.MISTAKEN for names in each.explanations]
        return tuple(dict.fromkeys(wrong))

    def found(self, outcomes: Sequence[Outcome] = SEEN) -> Trial | None:
        """The smallest trial that ended so, with every larger one."""
        smallest = None
        for trial in reversed(self.trials):
            if trial.outcome not in outcomes:
                break
            smallest = trial
        return smallest

    def _from(self, outcomes: Sequence[Outcome]) -> float | None:
        found = self.found(outcomes)
        return None if found is None else found.size


@dataclass(frozen=True)
class SelfTest:
    """A self-test: what was said where nothing was hidden, and of every effect."""

    clean: Trial
    sought: tuple[Sought, ...]
    units: dict[str, str]  # of parameters, by full name
    rmse: float = 0.0  # N, by which the model itself misses the recordings
    over_noise: float = 0.0  # the same in standard deviations of one reading


@dataclass
class Log:
    """The file of a self-test: a line for each diagnosis, under the mark of what makes a result the same.

    Lines of other marks, and the torn one of a kill, are passed by. Without a file nothing is kept.
    """

    path: Path | None
    mark: str = ""
    again: bool = False  # what is kept does not count

    def check(self) -> None:
        """Refuse a file that is there and is no log of a self-test."""
        lines = self._lines()
        if lines and not any(line.startswith('{"mark":') for line in lines):
            cure = "name another file with --log"
            raise InputError("the file is no log of a self-test and is left alone", self.path, cure=cure)

    def known(self) -> dict[tuple[str, float], Trial]:
        """The trials that were made before, by effect and times its limit."""
        found = {}
        for line in [] if self.again else self._lines():
            try:
                told = json.loads(line)
                if told.pop("mark") == self.mark:
                    trial = Trial.read(told)
                    found[trial.effect, trial.times] = trial
            except (ValueError, TypeError, KeyError, AttributeError):
                continue
        return found

    def keep(self, trial: Trial) -> None:
        """Add a trial."""
        if self.path is None:
            return
        text = json.dumps({"mark": self.mark, **asdict(trial)}, ensure_ascii=False)
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(f"\n{text}\n" if self._is_torn() else f"{text}\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            cure = "name another file with --log, or make room; what was found so far is kept"
            raise InputError(f"the file cannot be written: {error.strerror}", self.path, cure=cure) from None

    def _is_torn(self) -> bool:
        """Whether a kill has left half a line at the end."""
        return self.path is not None and self.path.exists() and self.path.read_bytes()[-1:] not in (b"", b"\n")

    def _lines(self) -> list[str]:
        if self.path is None or not self.path.exists():
            return []
        try:
            return self.path.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise InputError(f"the file cannot be read: {error.strerror}", self.path, cure="name another") from None
