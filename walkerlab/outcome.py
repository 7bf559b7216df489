"""Outcomes of walks, each with descriptions, advice and a colour. An outcome is a value, never an exception."""

from enum import IntEnum
from typing import NamedTuple


class Outcome(IntEnum):
    """Outcome of a walk. Kernels return the integer value."""

    WALKED = 0
    FELL = 1
    OFF_PAD = 2
    LIFTED_OFF = 3
    SLID = 4
    NO_HEEL_STRIKE = 5
    BUDGET_EXHAUSTED = 6
    SOLVER_FAILED = 7
    REJECTED = 8
    BENT_KNEE = 9
    STUBBED = 10

    @property
    def label(self) -> str:
        """Name of the outcome in tables and JSON."""
        return self.name.lower().replace("_", "-")

    @property
    def answered(self) -> bool:
        """Whether the walk has a definite result. A fall is one, but a failed solver is not."""
        return self not in (Outcome.BUDGET_EXHAUSTED, Outcome.SOLVER_FAILED)

    @property
    def stumbled(self) -> bool:
        """Whether the walk ended because the walker could not continue."""
        return self.answered and self not in (Outcome.WALKED, Outcome.REJECTED)

    @property
    def advice(self) -> str:
        return OUTCOME_TEXTS[self].advice

    @property
    def advice_on_uneven_ground(self) -> str:
        """Advice for a walk on uneven ground, where any start may fail."""
        return ADVICE_ON_UNEVEN_GROUND.get(self, self.advice)


def outcome_of(label: str) -> Outcome | None:
    """Return the outcome with this label, or None if the label is unknown."""
    return next((outcome for outcome in Outcome if outcome.label == label), None)


class OutcomeWords(NamedTuple):
    does: str  # what one walker does, in the present tense
    did: str  # what several walks did, in the past tense
    why: str  # reason why a family of gaits ends with this outcome
    colour: str  # colour on maps: saturated for walking, pale for failures
    advice: str  # meaning of the outcome, and what to try next


OUTCOME_TEXTS = {
    Outcome.WALKED: OutcomeWords(
        "walks to the end",
        "walked on",
        "",
        "#56B4E9",
        "The walker took every requested step.",
    ),
    Outcome.FELL: OutcomeWords(
        "falls",
        "fell",
        "the walker falls before the foot comes down",
        "#EDEDED",
        "The hip came below half a leg above the slope; start nearer to a gait (start: fixed-point).",
    ),
    Outcome.OFF_PAD: OutcomeWords(
        "trips on a pad",
        "hit the side of a pad or tripped on the one they left",
        "the swing foot hits the side of a pad, or trips on the pad it left",
        "#F7CF85",
        "A foot hit the side of a pad, or tripped on the pad it had left: the steps do not fit the "
        "pads; try contact.terrain: after-mid-swing, or another contact.pad_pitch.",
    ),
    Outcome.LIFTED_OFF: OutcomeWords(
        "leaves the ground",
        "left the ground",
        "the ground would have to pull on the foot",
        "#DDB3CC",
        "The walker left the ground: no foot was in contact for a quarter of a pendulum time or, in the rigid model, "
        "the ground would have had to pull on the foot; slow the start down, or stiffen or damp the contact.",
    ),
    Outcome.SLID: OutcomeWords(
        "slides away",
        "slid away",
        "the stance foot slides away",
        "#A6D3B4",
        "The stance foot slid by more than a quarter of a step; raise friction or lower the stiction velocity.",
    ),
    Outcome.NO_HEEL_STRIKE: OutcomeWords(
        "never reaches a heel strike",
        "never reached a heel strike",
        "the swing foot does not come down",
        "#7F7F7F",
        "The swing foot did not come down within ten pendulum times; the start is far from walking.",
    ),
    Outcome.BUDGET_EXHAUSTED: OutcomeWords(
        "exhausts its evaluation budget",
        "ran out of function evaluations",
        "a step exceeds its evaluation budget",
        "#000000",
        "The run exhausted its evaluation budget; loosen solver.*.rtol, soften the contact, or ask for fewer strides.",
    ),
    Outcome.SOLVER_FAILED: OutcomeWords(
        "makes the solver fail",
        "made the solver fail",
        "the solver's steps shrank to rounding error, or the energy balance does not close",
        "#5B3A1E",
        "The steps shrank to rounding error, or the energy balance does not close; choose another solver.*.rtol or "
        "solver.*.method.",
    ),
    Outcome.REJECTED: OutcomeWords(
        "starts in a state that is not allowed",
        "started in a state that is not allowed",
        "its push-off is not over when the feet pass each other",
        "#FFFFFF",
        "The start is not a possible state of this walker.",
    ),
    Outcome.BENT_KNEE: OutcomeWords(
        "lands on a bent knee",
        "came down on a bent knee",
        "the foot comes down on a knee that has not locked",
        "#A9B8E0",
        "A foot came down on a knee that had not locked; start nearer to a gait (start: fixed-point), or, on compliant "
        "ground, release the trailing knee by compression (walker.knee.release).",
    ),
    Outcome.STUBBED: OutcomeWords(
        "stubs its foot",
        "stubbed a foot",
        "the swing foot is below its next foothold as the feet pass",
        "#E7C9A9",
        "The swing foot was below its next foothold when the feet passed each other; lower the footholds (ground), or "
        "try contact.terrain: after-mid-swing.",
    ),
}
TRY_EVEN_GROUND = (
    "lower the footholds (ground.heights_m, ground.roughness_m). On even ground (ground.roughness_m: 0) the same start "
    "shows whether it walks at all, and `walkerlab robustness` shows what roughness the gait survives."
)
ADVICE_ON_UNEVEN_GROUND = {
    Outcome.FELL: "On this uneven ground the hip came below half a leg above the slope or, in the rigid model, a foot "
    f"landed less than a quarter of a step ahead; {TRY_EVEN_GROUND}",
    Outcome.NO_HEEL_STRIKE: "On this uneven ground the swing foot did not come down within ten pendulum times; "
    f"{TRY_EVEN_GROUND}",
    Outcome.BENT_KNEE: f"On this uneven ground a foot came down on a knee that had not locked; {TRY_EVEN_GROUND}",
}
"""Advice by outcome, where it differs on uneven ground."""
