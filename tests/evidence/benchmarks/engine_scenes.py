"""The paper's compass and the kneed walker on their ground, in the form that engines get."""

from functools import cache
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.evidence.benchmarks.engines.stage import supported_scene

GAIT = (-0.2042004, 0.1694004, -0.605819, -0.861041)
STEP_LENGTH = 0.3714
KNEED_GAIT = (-0.2889854603, 0.1881854603, -0.2889854603, -0.0571481063, -1.1095873312, -0.0571481063)
KNEED_STEP_LENGTH = 0.4726567858


HEAVIER_LEG = "walker.leg_2={leg_mass_kg: 5.5}"
LIMPING_GAIT = (-0.2001364762664855, 0.1653364762664855, -0.598697614198469, -0.8595634480514858)
LIMPING_STEP_LENGTH = 0.36772658000725655
LIMPING_ASYMMETRY = -0.023301283643594035


@cache
def limping():
    """Return the scene of the paper's compass with a leg 2 of 5.5 kg. Each foot has pads at its own footholds."""
    config = load(None, (HEAVIER_LEG,)).config
    return supported_scene(config, LIMPING_STEP_LENGTH, LIMPING_GAIT, LIMPING_ASYMMETRY)


ONE_KNEE_GROUND = "contact={stiffness: 300000, damping: 270, stiction_velocity: 10, friction_velocity: 100}"
ONE_KNEE_GAIT = (
    -0.32894529608999673, 0.24894529608999671, -0.32894529608999673,
    -0.5742680472677808, -1.1670910305869249, -0.5742680472677808,
)  # fmt: skip


@cache
def one_knee():
    """Return the scene of the walker that has a knee in leg 1 and none in leg 2."""
    config = load(Path("one-knee"), (ONE_KNEE_GROUND,)).config
    return supported_scene(config, 0.42478605569498096, ONE_KNEE_GAIT, 0.05797768479511639)


@cache
def compass(*sets):
    return supported_scene(load(None, sets).config, STEP_LENGTH, GAIT)


@cache
def kneed(*sets):
    return supported_scene(load(Path("kneed"), sets).config, KNEED_STEP_LENGTH, KNEED_GAIT)
