"""What a model predicted of data to which nothing of it was fitted yet."""

from collections.abc import Sequence
from typing import Any

from fitting.comparison.compare import Comparison
from fitting.report.text.amounts import amount, percent
from fitting.report.text.names import marked


def predicted_text(before: Comparison, fitted: Sequence[str]) -> str:
    """How large the error was before these values were fitted, which makes the other errors no predictions."""
    error = f"{amount(before.rmse, before.unit)}, {percent(before.share)} of full scale"
    return (
        f"With the values of the model file and the sizes that muscle.toml states, the RMS error is {error}. Then "
        f"{marked(fitted)} {'was' if len(fitted) == 1 else 'were'} fitted to these data: the errors below are no "
        "predictions."
    )


def predicted_result(before: Comparison, fitted: Sequence[str]) -> dict[str, Any]:
    """The same for machines, in SI."""
    return {"predicted": {"rmse": before.rmse, "unit": before.unit, "then_fitted": list(fitted)}}
