"""What a posterior says: its record, how far the chains can be trusted, and the words and numbers for others."""

import math
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import emcee
import numpy as np

from fitting import units
from fitting.least_squares import Fit
from fitting.residuals import Samples
from fitting.uncertainty import clusters

CORRELATION_TIMES, RHAT = 50, 1.01  # a chain is long enough from here on, and ensembles agree below this
ROBUST_EXCESS = 1.5  # times the posterior's standard deviation: the model leaves errors that loops share
MISFIT_EXCESS = 2.0  # times the noise of a reading: something is missing from the model
FEW_LOOPS = 8  # fewer say little about what loops share


@dataclass(frozen=True)
class Quantity:
    """One parameter's posterior, SI. `robust_error` is the fit's standard error, robust to errors shared in a loop."""

    median: float
    q05: float
    q95: float
    sd: float
    rhat: float
    ess_bulk: float
    ess_tail: float
    robust_error: float
    unit: str


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
        return _arviz().from_dict(posterior=data, attrs={"ensembles": e, "walkers": walkers})


@dataclass(frozen=True)
class Posterior:
    """What the data leave open. Any warning means that the quantiles must not be taken at their word."""

    parameters: dict[str, Quantity]
    noise: dict[str, Quantity]  # by unit of measurement: misfit in units of the noise of one reading
    held: tuple[str, ...]  # asked to vary, but these data cannot see them
    draws: Draws
    readings: int
    counted: float  # independent readings that they amount to
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the quantiles."""
        return not self.warnings


def _arviz() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # arviz announces its next version at every start
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


def slim(chains: np.ndarray) -> np.ndarray:
    """Every step that tells something new: two for each correlation time."""
    time = correlation_steps(chains)
    return chains[:, :: max(1, int(time / 2)) if np.isfinite(time) else 1]


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
    return float(_arviz().rhat(halves(chains)))


def settled(chains: np.ndarray) -> bool:
    """Whether the chains are longer than 50 correlation times and the ensembles agree."""
    long = chains.shape[1] > CORRELATION_TIMES * correlation_steps(chains)
    return long and all(_rhat(chains[..., i]) < RHAT for i in range(chains.shape[-1]))


def unsettled(names: tuple[str, ...], chains: np.ndarray, ended: str) -> tuple[str, ...]:
    """What is missing for the chains to be trusted."""
    told = []
    steps, time = chains.shape[1], correlation_steps(chains)
    if not steps > CORRELATION_TIMES * time:
        times = steps / time
        more = f"; about {math.ceil(CORRELATION_TIMES / times)} times as many steps are needed" if times > 0 else ""
        told.append(f"stopped {ended}: the chain is {times:.0f} correlation times long, not {CORRELATION_TIMES}{more}")
    apart = [f"{name} {r:.3f}" for i, name in enumerate(names) if not (r := _rhat(chains[..., i])) < RHAT]
    if apart:
        told.append(f"stopped {ended}: the ensembles do not agree yet, R-hat {', '.join(apart)} (wanted: {RHAT})")
    return tuple(told)


def quantities(fit: Fit, names: tuple[str, ...], chains: np.ndarray) -> dict[str, Quantity]:
    """Quantiles and their trustworthiness by name."""
    unit = {entry.name: entry.unit for entry in fit.layout.entries}
    found = {}
    for i, name in enumerate(names):
        one, apart = chains[..., i].reshape(-1), halves(chains[..., i])
        q05, median, q95 = map(float, np.quantile(one, (0.05, 0.5, 0.95)))
        found[name] = Quantity(
            median=median,
            q05=q05,
            q95=q95,
            sd=float(np.std(one)),
            rhat=_rhat(chains[..., i]),
            ess_bulk=float(_arviz().ess(apart, method="bulk")),
            ess_tail=float(_arviz().ess(apart, method="tail")),
            robust_error=fit.error(name),
            unit=unit.get(name, "1"),
        )
    return found


# Whether the model can be trusted -------------------------------------------------------------------------------------


def doubts(fit: Fit, found: dict[str, Quantity]) -> tuple[str, ...]:
    """What speaks against the quantiles although the chains may be perfect."""
    told = [] if fit.converged else ["the fit that the walkers start from did not converge"]
    for name in fit.free:
        mine = found[name]
        if name not in fit.at_bound and mine.robust_error > ROBUST_EXCESS * mine.sd:
            times = mine.robust_error / mine.sd
            told.append(
                f"{name}: the error robust to what loops share is {times:.1f} times the posterior's standard "
                "deviation: the model leaves errors that are no noise"
            )
    for name, scale in found.items():
        if name.startswith("noise.") and scale.median > MISFIT_EXCESS:
            told.append(
                f"the misfit in {name.removeprefix('noise.')} is {scale.median:.1f} times the noise of a reading: "
                "something is missing from the model, and the quantiles do not know of it; diagnose first"
            )
    return tuple(told)


def notes(fit: Fit, weight: Any, samples: Samples) -> tuple[str, ...]:
    """What to know, without doubt in it."""
    count = float(np.sum(weight))
    told = [f"{len(samples)} readings count as {count:.0f}: neighbouring errors are alike, over their correlation time"]
    if len(samples) < len(fit.samples):
        told.append(f"thinned from {len(fit.samples)} readings; where errors are independent this widens the posterior")
    loops = len(np.unique(clusters(fit.samples)))
    if loops < FEW_LOOPS:
        told.append(f"{loops} loops only: the robust error says little")
    if fit.at_bound:
        told.append(f"the fit ends at an end of the range, which cuts the posterior off: {', '.join(fit.at_bound)}")
    if fit.held:
        told.append(f"these data cannot see, and nothing was sampled of: {', '.join(fit.held)}")
    return tuple(told)


# For others -----------------------------------------------------------------------------------------------------------


def to_json(posterior: Posterior) -> dict[str, Any]:
    """For machines: SI, the unit beside."""
    return {
        "parameters": {name: _finite(asdict(q)) for name, q in posterior.parameters.items()},
        "noise": {unit: _finite(asdict(q)) for unit, q in posterior.noise.items()},
        "held": list(posterior.held),
        "readings": posterior.readings,
        "independent_readings": posterior.counted,
        "trusted": posterior.trusted,
        "warnings": list(posterior.warnings),
        "notes": list(posterior.notes),
    }


def _finite(entries: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in entries.items()}


def describe(posterior: Posterior) -> str:
    """For people: one line per parameter, then whether to trust it."""
    width = max(map(len, posterior.parameters), default=0)
    lines = [f"{'':{width}}  {'median':>14} {'5 %':>14} {'95 %':>14}   {'robust +/-':>12}  R-hat  effective samples"]
    for name, q in posterior.parameters.items():
        shown, size = units.shown_in(q.unit, abs(q.median))
        low, middle, high, error = (f"{x / size:.4g} {shown}".strip() for x in (q.q05, q.median, q.q95, q.robust_error))
        values = f"{middle:>14} {low:>14} {high:>14}   {error:>12}"
        lines.append(f"{name:{width}}  {values}  {q.rhat:.3f}  {min(q.ess_bulk, q.ess_tail):.0f}")
    lines += [f"misfit in {unit}: {q.median:.2f} times the noise of a reading" for unit, q in posterior.noise.items()]
    lines += [f"warning: {text}" for text in posterior.warnings] or ["trusted: nothing speaks against these quantiles"]
    return "\n".join([*lines, *(f"note: {text}" for text in posterior.notes)])


def save(posterior: Posterior, path: Path | str) -> None:
    """Write the chains as netCDF, which arviz and xarray read."""
    posterior.draws.inference_data().to_netcdf(str(path))
