"""What a posterior says: its record, how far the chains can be trusted, and the words and numbers for others."""

import errno
import math
import os
import shutil
import warnings
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import emcee
import numpy as np

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.posterior.predict import Band
from fitting.posterior.settings import QUICK, SAMPLER
from fitting.posterior.target import PosteriorProblem

OVERHEAD = 200_000  # bytes of a netCDF file besides the draws
MANY_FILES = 3  # above which a text gives the shares of them together


@dataclass(frozen=True)
class Quantity:
    """One parameter's posterior, SI. `robust_error` is its standard deviation, robust to errors shared in a loop.

    `contraction` is the share of the prior's variance that the data took away, `prior_sensitivity` how far a sharper or
    wider prior would move it (above 0.05 the prior has a say). R-hat is NaN where draws are independent.
    """

    median: float
    q05: float
    q95: float
    sd: float
    rhat: float
    ess_bulk: float
    ess_tail: float
    robust_error: float
    unit: str
    prior: str = ""
    contraction: float = float("nan")
    prior_sensitivity: float = float("nan")


@dataclass(frozen=True)
class Missing:
    """The test that nothing is missing from the model, with which a diagnosis begins."""

    p_value: float
    level: float
    rejected: bool
    rests_on: str


@dataclass(frozen=True)
class Draws:
    """The chains, thinned to half their correlation time: (ensemble, step, walker, parameter), SI."""

    names: tuple[str, ...]
    values: np.ndarray

    def inference_data(self) -> Any:
        """The same for arviz: every walker is a chain, those of an ensemble next to each other."""
        e, steps, walkers, _ = self.values.shape
        chains = np.moveaxis(self.values, 1, 2).reshape(e * walkers, steps, len(self.names))
        data = {name.replace("/", "_"): chains[..., i] for i, name in enumerate(self.names)}
        return arviz().from_dict(posterior=data, attrs={"ensembles": e, "walkers": walkers})


@dataclass(frozen=True)
class Posterior:
    """What the data leave open. Any warning means that the quantiles must not be taken at their word."""

    parameters: dict[str, Quantity]
    noise: dict[str, Quantity]  # sizes in units of the noise of one reading, memories in readings
    held: tuple[str, ...]  # asked to vary, but these data cannot see them
    draws: Draws
    bands: list[Band]
    readings: int
    method: str
    settled: bool  # whether the chains are long enough and agree
    calibrated: bool  # whether nothing says that the model or its noise is wrong
    missing: Missing | None
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the quantiles."""
        return not self.warnings

    def of_independent(self, effective: float, khat: float) -> "Posterior":
        """The same for weighted draws that are no chain: R-hat says nothing, the weights say what they are worth."""
        nan = float("nan")
        parameters, noise = (
            {name: replace(q, rhat=nan, ess_bulk=effective, ess_tail=effective) for name, q in some.items()}
            for some in (self.parameters, self.noise)
        )
        said = khat_text(khat) if self.settled else f"k-hat {khat:.2f}"  # else a warning has said what that is
        note = f"{self.method}: the draws are worth {effective:.0f} independent ones, {said}"
        return replace(self, parameters=parameters, noise=noise, notes=(*self.notes, note))


def khat_text(khat: float) -> str:
    """What k-hat is, with its value."""
    return f"k-hat {khat:.2f} (reliable below {QUICK.khat}: above it a few draws outweigh all others)"


def arviz() -> Any:
    """The library, which announces its next version at every start."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import arviz
    return arviz


# How far the chains can be trusted ------------------------------------------------------------------------------------


def correlation_steps(chains: np.ndarray) -> float:
    """Longest autocorrelation time of any parameter, in steps; infinite where a chain stands still.

    `chains` are (ensemble, step, walker, parameter) here and below. Mean over ensembles of emcee's estimate.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        times = np.mean([emcee.autocorr.integrated_time(chain, tol=0, quiet=True) for chain in chains], axis=0)
    return float(np.max(np.where(np.isfinite(times), np.maximum(times, 1.0), np.inf)))


def effective_samples(chains: np.ndarray) -> float:
    """Independent samples that the chains amount to, for the parameter that has the fewest."""
    ensembles, steps, walkers, _ = chains.shape
    return ensembles * steps * walkers / correlation_steps(chains)


def halves(chains: np.ndarray) -> np.ndarray:
    """One parameter's chains (ensemble, step, walker) as independent sequences: ensembles, first and second half.

    Walker stands behind walker, for those of one ensemble are no independent chains.
    """
    ensembles, steps, walkers = chains.shape
    cut = chains[:, : steps // 2 * 2].reshape(ensembles, 2, steps // 2, walkers)
    return np.moveaxis(cut, 3, 2).reshape(2 * ensembles, -1)


def _rhat(chains: np.ndarray) -> float:
    return float(arviz().rhat(halves(chains)))


def is_settled(chains: np.ndarray) -> bool:
    """Whether the chains are longer than 50 correlation times and the ensembles agree."""
    long = chains.shape[1] > SAMPLER.correlation_times * correlation_steps(chains)
    return long and all(_rhat(chains[..., i]) < SAMPLER.rhat for i in range(chains.shape[-1]))


def convergence_warnings(names: tuple[str, ...], chains: np.ndarray, ended: str) -> tuple[str, ...]:
    """Why the chains cannot be trusted yet: too short, or ensembles that disagree."""
    messages = []
    steps, time, wanted = chains.shape[1], correlation_steps(chains), SAMPLER.correlation_times
    if not steps > wanted * time:
        times = steps / time
        more = f"; about {math.ceil(wanted / times)} times as many steps are needed" if times > 0 else ""
        messages.append(f"stopped {ended}: the chain is {times:.0f} correlation times long, not {wanted}{more}")
    apart = [f"{name} {r:.3f}" for i, name in enumerate(names) if not (r := _rhat(chains[..., i])) < SAMPLER.rhat]
    if apart:
        values = f"R-hat {', '.join(apart)} (wanted: {SAMPLER.rhat})"
        messages.append(f"stopped {ended}: the ensembles do not agree yet, {values}")
    return tuple(messages)


def quantities(fit: Fit, setup: PosteriorProblem, chains: np.ndarray, robust: np.ndarray) -> dict[str, Quantity]:
    """Quantiles and their trustworthiness by name; `robust` multiplies the standard deviations."""
    found = {}
    for i, name in enumerate(setup.names):
        one, apart = chains[..., i].reshape(-1), halves(chains[..., i])
        q05, median, q95 = map(float, np.quantile(one, (0.05, 0.5, 0.95)))
        sd, prior = float(np.std(one)), setup.priors.get(name)
        found[name] = Quantity(
            median=median,
            q05=q05,
            q95=q95,
            sd=sd,
            rhat=_rhat(chains[..., i]),
            ess_bulk=float(arviz().ess(apart, method="bulk")),
            ess_tail=float(arviz().ess(apart, method="tail")),
            robust_error=float(robust[i]) * sd,
            unit=fit.layout.entry(name).unit if name in fit.free else "1",  # the parts of the noise are plain numbers
            prior="" if prior is None else prior.told(fit.layout.entry(name).unit),
            contraction=float("nan") if prior is None else 1 - (sd / setup.spreads[name]) ** 2,
        )
    return found


# For others -----------------------------------------------------------------------------------------------------------


def to_json(posterior: Posterior) -> dict[str, Any]:
    """For machines: SI, the unit beside."""
    return {
        "parameters": {name: _finite(asdict(q)) for name, q in posterior.parameters.items()},
        "noise": {unit: _finite(asdict(q)) for unit, q in posterior.noise.items()},
        "held": list(posterior.held),
        "readings": posterior.readings,
        "method": posterior.method,
        "settled": posterior.settled,
        "calibrated": posterior.calibrated,
        "missing": None if posterior.missing is None else asdict(posterior.missing),
        "predicted": [{"file": b.file, "run": b.name, "inside_90": b.inside} for b in posterior.bands],
        "trusted": posterior.trusted,
        "warnings": list(posterior.warnings),
        "notes": list(posterior.notes),
    }


def _finite(entries: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in entries.items()}


LEGEND = (
    "learned: the share of the prior's variance that the data took away; R-hat: 1.00 where chains agree; "
    "bulk and tail: how many independent draws the median and the ends of the interval rest on"
)


def describe(posterior: Posterior) -> str:
    """For people: what is known of each parameter, then whether to trust it."""
    rows = table_rows(posterior.parameters)
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
    lines += [LEGEND, "", *(f"WARNING  {text}" for text in posterior.warnings)]
    lines += [] if posterior.warnings else ["TRUSTED  nothing speaks against these intervals"]
    return "\n".join([*lines, f"90 % band holds {inside_text(posterior)}", *posterior.notes])


def table_rows(parameters: dict[str, Quantity]) -> list[tuple[str, ...]]:
    """Heads, then one row for each parameter: in the units that people read."""
    heads = ("", "median", "5 %", "95 %", "robust +/-", "learned", "R-hat", "bulk", "tail")
    return [heads, *(_line(name, q) for name, q in parameters.items())]


def _line(name: str, q: Quantity) -> tuple[str, ...]:
    shown, size = showing.shown_in(q.unit, abs(q.median))
    places = figures((q.q95 - q.q05) / size)
    values = (f"{x / size:.{places}f} {shown}".strip() for x in (q.median, q.q05, q.q95, q.robust_error))
    learned = "-" if math.isnan(q.contraction) else f"{100 * max(q.contraction, 0):.4g} %"
    chain = "-" if math.isnan(q.rhat) else f"{q.rhat:.3f}"
    return name, *values, learned, chain, f"{q.ess_bulk:.0f}", f"{q.ess_tail:.0f}"


def figures(width: float) -> int:
    """Digits behind the point that show an interval of this width with two figures."""
    return max(0, 1 - math.floor(math.log10(width))) if width > 0 and math.isfinite(width) else 4


def inside_text(posterior: Posterior) -> str:
    """How often the readings lie where they should."""
    shares: dict[str, list[float]] = {}
    for band in posterior.bands:
        shares.setdefault(band.file, []).append(100 * band.inside)
    if len(shares) > MANY_FILES and all(len(each) == 1 for each in shares.values()):
        alone = [each[0] for each in shares.values()]
        return f"{np.mean(alone):.0f} % of the readings ({min(alone):.0f} to {max(alone):.0f} % by file)"
    return "; ".join(_inside_text(file, each) for file, each in shares.items())


def _inside_text(file: str, shares: list[float]) -> str:
    by_run = f" ({min(shares):.0f} to {max(shares):.0f} % by run)" if len(shares) > 1 else ""
    return f"{np.mean(shares):.0f} % of {file}{by_run}"


def save(posterior: Posterior, path: Path | str) -> None:
    """Write the chains as netCDF, which arviz and xarray read; OSError where there is no room.

    The room is asked for before: where HDF5 runs out of it, it takes the whole program down as that ends.
    """
    if shutil.disk_usage(Path(path).resolve().parent).free < posterior.draws.values.nbytes + OVERHEAD:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
    posterior.draws.inference_data().to_netcdf(str(path))
