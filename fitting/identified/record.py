"""What is known of an identified muscle: the record in `identified.json` beside its data and its model."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fitting.errors import InputError
from fitting.version import program_version
from fitting.writing import write_text

FILE, FORMAT = "identified.json", 1


@dataclass(frozen=True)
class Known:
    """One number: value, standard error (None where it did not vary), middle 90 % of its posterior if trusted; SI."""

    value: float
    unit: str
    state: str  # fitted, fixed, or held
    error: float | None = None
    q05: float | None = None
    q95: float | None = None


@dataclass(frozen=True)
class Behaviour:
    """What a muscle does at one pressure (Pa), moved slowly: how muscles with other effects are compared."""

    pressure: float
    pull_at_rest: float  # N
    pull_over_section: float  # of the pressure on the section of the braid at rest
    stroke: float  # contraction at which nothing is pulled
    loop_width: float | None  # N, between the two branches at half the stroke; None where friction was not seen
    rubber: float  # N, with which the rubber opposes at half the stroke


@dataclass(frozen=True)
class Identified:
    """An identified muscle. Errors in N; `behaviour` by name of its field."""

    name: str
    effects: tuple[str, ...]
    parameters: Mapping[str, Known]  # by full name, the muscle's sizes among them
    behaviour: Behaviour
    rmse: float
    held_out_rmse: float
    full_scale: float
    readings: int
    verdict: str
    explanations: tuple[tuple[str, ...], ...]
    is_trusted: bool  # nothing speaks against the quick posterior
    source: Mapping[str, str]
    sha256: str  # of the data
    program: str = field(default_factory=program_version)

    @classmethod
    def read(cls, folder: Path) -> "Identified":
        """From the file in a folder; InputError where it is none of ours."""
        path = folder / FILE
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            if told.pop("format") != FORMAT:
                raise ValueError
            found = cls(
                **{
                    **told,
                    "effects": tuple(told["effects"]),
                    "parameters": {name: Known(**known) for name, known in told["parameters"].items()},
                    "behaviour": Behaviour(**told["behaviour"]),
                    "explanations": tuple(tuple(names) for names in told["explanations"]),
                }
            )
            found.check()
        except OSError as error:
            raise InputError(f"the file cannot be read: {error.strerror}", path, cure="add the muscle anew") from None
        except (ValueError, TypeError, KeyError, AttributeError):
            cure = "'mckibben library add FOLDER' makes it anew from the data and the model"
            raise InputError("this program reads no identified muscle from the file", path, cure=cure) from None

        return found

    def check(self) -> None:
        """ValueError, KeyError or TypeError where a number is none, or a size of the muscle lacks."""
        sizes = [self.parameters[f"muscle.{name}"].value for name in ("length", "radius", "braid_angle")]
        numbers = [*sizes, *(known.value for known in self.parameters.values()), self.rmse, self.held_out_rmse]
        behaviour = [value for value in vars(self.behaviour).values() if value is not None]
        if not all(math.isfinite(float(number)) for number in (*numbers, *behaviour, self.full_scale, self.readings)):
            raise ValueError
        for text in (self.name, self.verdict, *self.effects, *(known.unit for known in self.parameters.values())):
            if not isinstance(text, str):
                raise TypeError

    def write(self, folder: Path) -> None:
        """Into a folder."""
        write_text(folder / FILE, json.dumps(self.as_dict(), indent=1, ensure_ascii=False, allow_nan=False) + "\n")

    def as_dict(self) -> dict[str, Any]:
        """As plain values, SI."""
        return {"format": FORMAT, **asdict(self)}
