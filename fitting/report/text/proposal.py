"""A proposed form in words and for machines."""

from typing import Any

from fitting.diagnosis.proposal import Proposal
from fitting.report.text.amounts import amount


def proposal_text(found: Proposal) -> str:
    """The proposal, or why there is none, in a sentence or two."""
    fell = ""
    if found.before is not None and found.after is not None and found.fall is not None:
        errors = (
            f"{amount(found.before, 'N')} -> {amount(found.after, 'N')} on {found.runs} runs, each held out in turn"
        )
        fell = f"{errors}; the squared error falls by {found.fall:.1f} times its standard error"
    if found.line is None:
        return f"None: {found.reason}{f' ({fell})' if fell else ''}."
    return f"A form, not yet a cause: {fell}. Judge it, then test it on new data:"


def proposal_result(found: Proposal) -> dict[str, Any]:
    """The proposal for machines."""
    return {
        "marked": "proposal",
        "define": found.line,
        "terms": list(found.terms),
        "held_out_rmse_N": found.after,
        "held_out_rmse_before_N": found.before,
        "fall_in_standard_errors": found.fall,
        "runs_left_out": found.runs,
        "reason": found.reason,
    }
