"""What a command or the workbench is asked for. Every option that several commands share is declared here, once.

The options of the command line, the lists among them, this record, and the words that ask for the same again are all
derived from the fields of `Request`. Loads nothing heavy.
"""

from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields
from pathlib import Path
from typing import Any

MODEL_FILE = "model.toml"  # beside the data, unless another is named
CHAINS = "posterior.chains"  # beside the data: what `posterior` keeps, and `report` and `export` use
MODEL, DATA, CANDIDATES, SEARCH, SHOOTING, SAVE, OUTPUT = (
    "model", "data", "candidates", "search", "shooting", "save", "output",
)  # fmt: skip


@dataclass(frozen=True)
class Option:
    """How one field of a request is given on the command line."""

    flag: str
    group: str  # commands take options by the group
    help: str
    metavar: str | None = None  # of its value; None for a switch
    least: int | None = None  # of a whole number
    most: int | None = None
    is_list: bool = False  # takes every name that follows, until the next option or path

    def words(self, value: Any) -> Iterator[str]:
        """What is typed to give this value."""
        if isinstance(value, tuple) and not self.is_list:
            yield from (word for one in value for word in (self.flag, one))
        elif isinstance(value, tuple):
            yield from (self.flag, *value)
        else:
            yield self.flag
            yield from () if value is True else (str(value),)


def _option(flag: str, group: str, metavar: str | None, text: str, default: Any = None, **more: Any) -> Any:
    return field(default=default, metadata={"option": Option(flag, group, text, metavar, **more)})


def _names(flag: str, group: str, text: str) -> Any:
    return _option(flag, group, "NAME...", text, (), is_list=True)


@dataclass(frozen=True)
class Request:
    """The data, the model, what may vary, how to search, and where the result goes: as typed or clicked."""

    data: tuple[str, ...] = ()

    model: str | None = _option(
        "--model", MODEL, "FILE", "Model file; without it the model.toml beside the data, if any."
    )
    effects: tuple[str, ...] = _names("--effects", MODEL, "The model's effects, all of them.")
    baseline: bool = _option("--baseline", MODEL, None, "Begin with the baseline, whatever model.toml says.", False)
    settings: tuple[str, ...] = _option("--set", MODEL, "NAME=VALUE", "Hold a parameter at this value.", ())
    fix: tuple[str, ...] = _names("--fix", MODEL, "Parameters that do not vary.")
    free: tuple[str, ...] = _names("--free", MODEL, "Parameters that vary though taken as exact.")
    own: tuple[str, ...] = _names("--own", MODEL, "Parameters that each data set has for itself.")
    define: tuple[str, ...] = _option("--define", MODEL, "LINE", "An effect: 'drag = -B*v, B = 5 N s/m (0..99)'.", ())
    effect_file: str | None = _option("--effect-file", DATA, "FILE", "Python file with effects of your own.")
    muscle: str | None = _option("--muscle", DATA, "FILE", "muscle.toml that belongs to a single CSV file.")
    test: str | None = _option("--test", DATA, "KIND", "Kind of test of a single CSV: loop, isometric, static, ...")

    candidates: tuple[str, ...] = _names("--candidates", CANDIDATES, "What may be missing; default: all effects.")
    rivals: bool = _option("--rivals", CANDIDATES, None, "Look at the printed rivals too.", False)

    starts: int = _option("--starts", SEARCH, "N", "Places that the search begins from.", 8, least=1)
    shooting: int = _option(
        "--shooting", SHOOTING, "N",
        "Cut recorded motions into N stretches to find where the search begins; try 8 where a fit ends far off.",
        0, least=0, most=100,
    )  # fmt: skip

    save: str | None = _option(
        "--save", SAVE, "FILE", "Where the fitted model goes; default: model.toml beside the data."
    )
    no_save: bool = _option("--no-save", SAVE, None, "Leave every model file as it is.", False)
    through_instruments: bool = _option(
        "--through-instruments", SAVE, None,
        "Save the values that are likelier where instruments err, not those of the curve of least error.", False,
    )  # fmt: skip

    json: str | None = _option("--json", OUTPUT, "FILE", "Write the result for machines, in SI units.")
    html: str | None = _option("--html", OUTPUT, "FILE", "Write the result as a page that needs no network.")
    seed: int = _option("--seed", OUTPUT, "N", "Seed of everything random.", 0, least=0)
    quiet: bool = _option("--quiet", OUTPUT, None, "Print nothing but errors.", False)

    @classmethod
    def of(cls, options: dict[str, Any]) -> "Request":
        """From the values of all options of a command; those of this command alone are left to it."""
        return cls(**{each.name: options[each.name] for each in fields(cls) if each.name in options})

    @property
    def model_file(self) -> str:
        """The model file of these data: the one that was named, else that beside the first data set."""
        return self.model or str(Path(*self.data[:1], MODEL_FILE))

    @property
    def data_again(self) -> tuple[str, ...]:
        """What is typed to name the same data on another command."""
        return (*self.words(*names_of(DATA)), *self.data)

    @property
    def again(self) -> tuple[str, ...]:
        """What is typed to name the same model and the same data on another command."""
        return (*self.words(*names_of(MODEL)), *self.data_again)

    def words(self, *names: str) -> tuple[str, ...]:
        """What is typed to give these fields the values that they have here; nothing for a default."""
        given = ((each, getattr(self, each.name)) for each in fields(self) if each.name in names)
        return tuple(word for each, value in given if value != each.default for word in option_of(each).words(value))


def option_of(each: Field) -> Option:
    """How a field of a request is given on the command line; KeyError for the data, which are arguments."""
    return each.metadata["option"]


def names_of(*groups: str) -> tuple[str, ...]:
    """The fields whose options belong to these groups, in their order."""
    return tuple(each.name for each in fields(Request) if each.metadata and option_of(each).group in groups)
