"""Stability maps with values set by hand, in the layout of the stage."""

from synthetic_walks import stored

from walkerlab.evidence.verification.stability_maps import (
    ERROR_MISSING,
    VERDICT_NAMES,
    step_group,
    stiction_group,
    summary_of,
)
from walkerlab.outcome import Outcome

CELLS = 3
# outcome, outcome at a ten times tighter tolerance, error
ENDS = (
    (Outcome.WALKED, Outcome.WALKED, 1e-9),
    (Outcome.OFF_PAD, Outcome.WALKED, ERROR_MISSING),
    (Outcome.BUDGET_EXHAUSTED, Outcome.BUDGET_EXHAUSTED, 0.0),
)


def stability_maps():
    """Return maps with one column per outcome. With a fixed step, verdicts are in the order of step sizes."""
    kept = {}
    for i in range(CELLS):
        for j, (outcome, sharper, error) in enumerate(ENDS):
            kept[f"stiction {i} {j}"] = [float(outcome), 4.0, float(sharper), error, 1e4]
        kept[f"step {i}"] = [0.0, 1e-5, 1.0, 0.3, float(VERDICT_NAMES.index("diverges")), ERROR_MISSING]
    stiction, step = stiction_group(CELLS, kept), step_group(CELLS, kept)
    content = {"stiction": stiction, "step": step}
    return {"stability-maps": stored("stability-maps", content, summary_of(stiction, step))}
