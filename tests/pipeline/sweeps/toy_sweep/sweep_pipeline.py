"""Graph of the toy pipeline for sweeps."""

from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.plan.stage import STRIDES, Stage, results_of


def keys(*names):
    """A type that names these keys of a config."""
    return type("Keys", (), dict.fromkeys(names, property(lambda _config: None)))


GRAPH = Graph(
    Stage("drop", "toy_sweep.falling_stone", "Drop a stone.", keys("gravity_m_s2", "slope_rad", "walker")),
    Stage("roll", "toy_sweep.rolling_stone", "Roll on.", keys("strides"), results_of("drop"), options=(STRIDES,)),
    Stage("deadly", "toy_sweep.deadly", "End the worker.", keys("seed")),
    Stage("count", "toy_sweep.counting", "Count in parts.", keys("seed")),
    Stage("picture", "toy_sweep.falling_stone", "Draw it.", keys("name"), work="draws"),
    at="toy_sweep.sweep_pipeline:GRAPH",
)
