"""What a model predicted of data to which nothing of it was fitted yet."""

from collections.abc import Sequence
from typing import Any

from fitting.comparison.compare import Comparison
from fitting.report.text.amounts import amount, percent
from fitting.report.text.names import marked


def predicted_text(before: Comparison, fitted: Sequence[str], of_hose: bool) -> str:
    """How large the error was before these values were fitted, which makes the other errors no predictions.

    `of_hose`: the model file knows the sizes of the hose that the muscle is cut from.
    """
    sizes = (
        "model file, those of the hose among them, and the other sizes that muscle.toml"
        if of_hose
        else "model file and the sizes that muscle.toml"
    )
    error = f"{amount(before.rmse, before.unit)}, {percent(before.share)} of full scale"
    return (
        f"With the values of the {sizes} states, the RMS error is {error}. Then "
        f"{marked(fitted)} {'was' if len(fitted) == 1 else 'were'} fitted to these data: the errors below are no "
        "predictions."
    )


def predicted_result(before: Comparison, fitted: Sequence[str]) -> dict[str, Any]:
    """The same for machines, in SI."""
    return {"predicted": {"rmse": before.rmse, "unit": before.unit, "then_fitted": list(fitted)}}
