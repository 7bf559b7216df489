"""The paper's compass on its ground, as engines get it."""

from functools import cache

from walkerlab.benchmarks.engines.scenes import scenes
from walkerlab.config.loader import load

GAIT = (-0.2042004, 0.1694004, -0.605819, -0.861041)
STEP_LENGTH = 0.3714


@cache
def compass(*sets):
    (scene,) = scenes(load(None, sets).config, STEP_LENGTH, GAIT)
    return scene
