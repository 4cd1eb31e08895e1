"""What an export says of the draws in it."""

from typing import Any


def draws_text(drawn: dict[str, Any], error: float | None) -> str:
    """From where draws are, and how far the force differs between them; `error` (N) is the model's own, if known."""
    told = f"from {drawn['from']}."
    if drawn["scatter_N"] is None:
        return told
    told += f" The force differs between them by {drawn['scatter_N']:.2g} N (one standard deviation, at the readings)."
    if error is None or drawn["scatter_N"] > 0.5 * error:
        return told
    return f"{told} What the model itself lacks is not in them: add an error of up to {error:.3g} N of your own."
