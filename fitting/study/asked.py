"""What a study was asked for, as it was typed or clicked. Loads nothing heavy."""

from dataclasses import dataclass
from typing import Any

MODEL_FILE = "model.toml"  # beside the data, unless another is named


@dataclass(frozen=True)
class Asked:
    """What was asked for on the command line, as it was typed."""

    data: tuple[str, ...] = ()
    muscle: str | None = None
    test: str | None = None
    model: str | None = None
    effects: tuple[str, ...] = ()
    baseline: bool = False
    settings: tuple[str, ...] = ()
    fix: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    effect_file: str | None = None
    define: tuple[str, ...] = ()
    starts: int = 8
    shooting: int = 0
    save: str | None = None
    no_save: bool = False
    seed: int = 0
    quiet: bool = False
    json: str | None = None
    html: str | None = None

    @property
    def model_file(self) -> str:
        """The model file of these data: the one that was named, else that beside the first data set."""
        return self.model or (f"{self.data[0]}/{MODEL_FILE}" if self.data else MODEL_FILE)

    @property
    def data_again(self) -> tuple[str, ...]:
        """What names the same data once more, on another command."""
        options = {"--muscle": self.muscle, "--test": self.test, "--effect-file": self.effect_file}
        return (*(word for name, value in options.items() if value for word in (name, value)), *self.data)

    @property
    def again(self) -> tuple[str, ...]:
        """What names the same data and the same model."""
        lists = {"--effects": self.effects, "--fix": self.fix, "--free": self.free, "--own": self.own}
        each = {"--set": self.settings, "--define": self.define}
        return (
            *(("--model", self.model) if self.model else ()),
            *(("--baseline",) if self.baseline else ()),
            *(word for name, values in each.items() for value in values for word in (name, value)),
            *(word for name, values in lists.items() if values for word in (name, *values)),
            *self.data_again,
        )

    @classmethod
    def of(cls, given: dict[str, Any]) -> "Asked":
        """From click's keyword arguments; those of a single command are left to it."""
        return cls(**{name: value for name, value in given.items() if name in cls.__dataclass_fields__})
