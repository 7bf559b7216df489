"""How a walk ends: a value with advice, never an exception."""

from enum import IntEnum


class Outcome(IntEnum):
    """Fate of a walk; the number is what kernels return."""

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

    @property
    def label(self) -> str:
        """The outcome as it is written in tables and JSON."""
        return self.name.lower().replace("_", "-")

    @property
    def advice(self) -> str:
        """What the outcome means and what to try next."""
        return ADVICE[self]

    @property
    def answered(self) -> bool:
        """Whether the question was answered: a walker that falls is an answer, a failed solver is not."""
        return self not in (Outcome.BUDGET_EXHAUSTED, Outcome.SOLVER_FAILED)

    @property
    def stumbled(self) -> bool:
        """Whether the walker itself could not go on."""
        return self.answered and self not in (Outcome.WALKED, Outcome.REJECTED)


ADVICE = {
    Outcome.WALKED: "The walker took every step it was asked for.",
    Outcome.FELL: "The hip came below half a leg above the slope; start nearer to a gait (start: fixed-point).",
    Outcome.OFF_PAD: "A foot met the flank of a pad below its top, or tripped over the pad it had left: the steps do "
    "not fit the pads; try contact.terrain: after-mid-swing, or another contact.pad_pitch.",
    Outcome.LIFTED_OFF: "The walker left the ground: no foot was in contact for a quarter of a pendulum time or, in "
    "the rigid model, the ground would have had to pull; slow the start down, or stiffen or damp the contact.",
    Outcome.SLID: "The stance foot slid by more than a quarter of a step; raise friction or lower the stiction "
    "velocity.",
    Outcome.NO_HEEL_STRIKE: "The swing foot did not come down within ten pendulum times; the start is far from "
    "walking.",
    Outcome.BUDGET_EXHAUSTED: "The run exhausted its evaluation budget; loosen solver.*.rtol, soften the contact, "
    "or ask for fewer strides.",
    Outcome.SOLVER_FAILED: "The step size fell to rounding, or the energy balance does not close; choose another "
    "solver.*.rtol or solver.*.method.",
    Outcome.BENT_KNEE: "A foot came down on a knee that had not locked; start nearer to a gait (start: fixed-point), "
    "or, on compliant ground, release the trailing knee by compression (walker.knee.release).",
    Outcome.REJECTED: "The start is not a state this walker can be in.",
}
