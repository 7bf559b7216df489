"""The graph."""

from walkerlab.stages.graph import Graph, Stage, results_of

GRAPH = Graph(
    Stage("drop", "toy_sweep.drop", "Drop a stone.", ("gravity", "slope", "walker")),
    Stage("roll", "toy_sweep.roll", "Roll on.", ("strides",), results_of("drop")),
    Stage("deadly", "toy_sweep.deadly", "End the worker.", ("seed",)),
    Stage("picture", "toy_sweep.drop", "Draw it.", ("name",), draws=True),
)
