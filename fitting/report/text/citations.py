"""What a result rests on, and whom to cite for it."""

from collections.abc import Sequence

from fitting.recordings.records import Experiment
from fitting.report.text.names import mark
from fitting.version import program_version
from mckibben_jax.effect import Effect, name_of

REVIEW = (
    "Tondu B 2012 Modelling of the McKibben artificial muscle: A review. "
    "J. Intell. Mater. Syst. Struct. 23(3): 225-253, doi 10.1177/1045389X11435435"
)
METHODS = (
    "least squares: optimistix; Rader, Lyons & Kidger 2024, arXiv 2402.09983",
    "collinearity of parameters: Brun, Reichert & Kuensch 2001, Water Resour. Res. 37: 1015",
    "tests by flipped signs: Hemerik, Goeman & Finos 2020, J. R. Stat. Soc. B 82: 841",
    "computing: JAX; Bradbury et al. 2018, github.com/jax-ml/jax",
)


def citations(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Sources by what they are for."""
    return {
        "program": [f"mckibben_jax {program_version()}"],
        "review": [REVIEW],
        "effects": [f"{mark(name_of(effect))}: {effect.source}" for effect in effects if effect.source],
        "data": [_data(e) for e in experiments],
        "methods": list(METHODS),
    }


def _data(experiment: Experiment) -> str:
    source = experiment.source
    parts = [source.get("citation") or "no source stated", source.get("licence") and f"licence: {source['licence']}"]
    return f"{experiment.name}: {'; '.join(part for part in parts if part)}"
