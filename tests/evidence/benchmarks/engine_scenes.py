"""The paper's compass and the kneed walker on their ground, as engines get them."""

from functools import cache
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.evidence.benchmarks.engines.scenes import supported_scene

GAIT = (-0.2042004, 0.1694004, -0.605819, -0.861041)
STEP_LENGTH = 0.3714
KNEED_GAIT = (-0.2889854603, 0.1881854603, -0.2889854603, -0.0571481063, -1.1095873312, -0.0571481063)
KNEED_STEP_LENGTH = 0.4726567858


@cache
def compass(*sets):
    return supported_scene(load(None, sets).config, STEP_LENGTH, GAIT)


@cache
def kneed(*sets):
    return supported_scene(load(Path("kneed"), sets).config, KNEED_STEP_LENGTH, KNEED_GAIT)
