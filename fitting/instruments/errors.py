"""What instruments within their accuracy can make of a recording: part of the null model of every test.

An error that stays the same for a run or for a whole recording looks like physics: a load cell whose gain differs from
run to run looks like an effect of the pressure. Every such error is a nuisance with a Gaussian prior whose width is the
instrument's accuracy. Marginalised, the rows have the covariance noise + U U', U being the change of the rows by one
standard deviation of each error; rows are whitened by it, and nothing that instruments could have made is left to look
for an effect in. What friction differs by from run to run (humidity, wear) is treated the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.instruments.sources import Source
from fitting.instruments.through import root


@dataclass(frozen=True)
class InstrumentErrors:
    """Changes of the rows by one standard deviation of each error, and where each comes from.

    Of `per_run` (rows, k) every run has a coefficient of its own, of `shared` (rows, m) all runs have the same.
    """

    per_run: np.ndarray
    shared: np.ndarray
    sources_per_run: tuple[Source, ...]
    sources_shared: tuple[Source, ...]
    run: np.ndarray  # (rows,) of each row

    @classmethod
    def none(cls, run: np.ndarray) -> "InstrumentErrors":
        """Instruments that do not err."""
        empty = np.zeros((len(run), 0))
        return cls(empty, empty, (), (), run)

    @property
    def sources(self) -> tuple[Source, ...]:
        """Every source once, in order."""
        return tuple(dict.fromkeys((*self.sources_per_run, *self.sources_shared)))

    @property
    def count(self) -> int:
        """How many columns there are, those of each run's own errors counted for every run."""
        return len(np.unique(self.run)) * self.per_run.shape[1] + self.shared.shape[1]

    @property
    def columns(self) -> np.ndarray:
        """All columns, those of single runs as a column for each run (rows, runs x k + m)."""
        runs = [np.where((self.run == one)[:, None], self.per_run, 0.0) for one in np.unique(self.run)]
        return np.hstack([*runs, self.shared])

    def changed(self, per_run: np.ndarray, shared: np.ndarray) -> "InstrumentErrors":
        """The same errors of other rows, for example whitened ones."""
        return replace(self, per_run=per_run, shared=shared)

    def at(self, rows: np.ndarray) -> "InstrumentErrors":
        """Of some rows alone (positions)."""
        return replace(self, per_run=self.per_run[rows], shared=self.shared[rows], run=self.run[rows])

    def widened(self, source: Source, times: float) -> "InstrumentErrors":
        """The same with one source so many times as large."""
        factors = [
            np.array([times if each == source else 1.0 for each in sources])
            for sources in (self.sources_per_run, self.sources_shared)
        ]
        return self.changed(self.per_run * factors[0], self.shared * factors[1])

    @property
    def allowed(self) -> "InstrumentErrors":
        """Only those that an accuracy allows."""
        return self.chosen([each for each in self.sources if each.allowed > 0])

    def chosen(self, sources: Sequence[Source]) -> "InstrumentErrors":
        """Only these."""
        own = [i for i, each in enumerate(self.sources_per_run) if each in sources]
        common = [i for i, each in enumerate(self.sources_shared) if each in sources]
        return InstrumentErrors(
            self.per_run[:, own],
            self.shared[:, common],
            tuple(self.sources_per_run[i] for i in own),
            tuple(self.sources_shared[i] for i in common),
            self.run,
        )

    def likeliest(self, rows: np.ndarray) -> tuple[Source | None, float]:
        """The largest of the most likely errors in rows of unit white noise (rows,): its source and size, in widths.

        U' (1 + U U')^-1 rows, whose variances are below 1 where instruments err as they may. None where none err.
        """
        left, found = self.whitener().residual(rows), list[tuple[Source, float]]()
        for one in np.unique(self.run):
            at = self.run == one
            found += zip(self.sources_per_run, np.abs(self.per_run[at].T @ left[at]).tolist(), strict=True)
        found += zip(self.sources_shared, np.abs(self.shared.T @ left).tolist(), strict=True)
        return max(found, key=lambda each: each[1], default=(None, 0.0))

    def whitener(self) -> "InstrumentWhitener":
        """What takes these errors out of rows of unit white noise."""
        return InstrumentWhitener.of(self)


@dataclass(frozen=True)
class InstrumentWhitener:
    """Multiplies by a root of the inverse of 1 + U U': first run by run, then what all runs share.

    The root is 1 - U M U' (`root`).
    """

    parts: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]  # rows, U (rows, k), M (k, k)

    @classmethod
    def of(cls, errors: InstrumentErrors) -> "InstrumentWhitener":
        """For rows of unit white noise beside these errors."""
        parts = []
        for one in np.unique(errors.run):
            at = np.flatnonzero(errors.run == one)
            parts.append((at, errors.per_run[at], root(errors.per_run[at])))
        shared = cls(tuple(parts))(errors.shared)
        return cls((*parts, (np.arange(len(errors.run)), shared, root(shared))))

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """Columns (rows, q) or rows (rows,), without these errors as far as priors let them go."""
        return self._applied(np.array(columns, dtype=float), self.parts)

    def residual(self, rows: np.ndarray) -> np.ndarray:
        """Rows (rows,) without the most likely errors: (1 + U U')^-1 rows."""
        return self._applied(self(rows), self.parts[::-1])

    def _applied(self, out: np.ndarray, parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
        for at, errors, taken in parts:
            if errors.shape[1]:
                out[at] -= errors @ (taken @ (errors.T @ out[at]))
        return out
