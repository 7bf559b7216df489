"""Graph of the toy pipeline."""

from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.plan.stage import STRIDES, Stage, results_of


def keys(*names):
    """A type that names these keys of a config."""
    return type("Keys", (), dict.fromkeys(names, property(lambda _config: None)))


def drop_unless_start_is_given(config):
    return ("drop",) if config.start == "fixed-point" else ()


ROLLS = keys("gravity_m_s2", "start", "strides")
GRAPH = Graph(
    Stage("drop", "toy.drop", "Drop a stone.", keys("gravity_m_s2", "slope_rad")),
    Stage("roll", "toy.roll", "Roll on.", ROLLS, drop_unless_start_is_given, options=(STRIDES,)),
    Stage("bounce", "toy.bounce", "Bounce.", keys("contact"), results_of("drop"), requires=("contact",)),
    Stage("survey", "toy.survey", "Time it.", keys("seed")),
    Stage("census", "toy.census", "Count the stones.", keys("seed"), only_by="survey --full"),
    Stage(
        "picture",
        "toy.picture",
        "Draw it.",
        keys("name"),
        results_of("drop", "roll", "bounce"),
        if_current=("survey",),
        work="draws",
    ),
    Stage(
        "page",
        "toy.page",
        "Write it up.",
        keys("name"),
        results_of("drop", "roll", "bounce", "survey", "picture"),
        if_current=("census",),
        work="draws",
    ),
    at="toy.pipeline:GRAPH",
)
