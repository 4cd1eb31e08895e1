"""What several models say of one recording, in words and for machines."""

from typing import Any

from fitting import showing
from fitting.report.text.amounts import amount
from fitting.study.several_models import SeveralModels


def several_models_texts(told: SeveralModels | None) -> list[str]:
    """How far the models lie apart, and what each counts for in the mean; nothing where there is one."""
    if told is None:
        return []
    where = f"contraction {told.contraction:.3g} and {showing.show(told.pressure, 'Pa')}"
    apart = (
        f"{told.file}. The {len(told.models)} models lie {amount(told.rms_apart, 'N')} apart (root mean square), "
        f"at most {amount(told.most_apart, 'N')} at {where}."
    )
    shares = ", ".join(f"{name} {100 * weight:.0f} %" for name, weight in zip(told.models, told.weights, strict=True))
    if told.why:
        return [apart, f"The mean counts them equally: {told.why}."]
    return [apart, f"The mean that foretells runs left out best: {shares}."]


def several_models_result(told: SeveralModels | None) -> dict[str, Any] | None:
    """The same for machines."""
    if told is None:
        return None
    weights = [{"model": name, "weight": weight} for name, weight in zip(told.models, told.weights, strict=True)]
    return {
        "file": str(told.file), "weights": weights, "why_equal": told.why or None, "rms_apart_N": told.rms_apart,
        "most_apart_N": told.most_apart, "contraction": told.contraction, "pressure_Pa": told.pressure,
    }  # fmt: skip
