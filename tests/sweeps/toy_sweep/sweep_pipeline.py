"""The graph."""

from walkerlab.stages.graph import Graph, Stage, results_of

GRAPH = Graph(
    Stage("drop", "toy_sweep.falling_stone", "Drop a stone.", ("gravity", "slope", "walker")),
    Stage("roll", "toy_sweep.rolling_stone", "Roll on.", ("strides",), results_of("drop")),
    Stage("deadly", "toy_sweep.deadly", "End the worker.", ("seed",)),
    Stage("count", "toy_sweep.counting", "Count in parts.", ("seed",), has_cells=True, keeps_parts=True),
    Stage("picture", "toy_sweep.falling_stone", "Draw it.", ("name",), draws=True),
)
