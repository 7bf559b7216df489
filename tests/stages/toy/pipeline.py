"""The graph."""

from walkerlab.stages.graph import Graph, Stage, results_of


def drop_unless_start_is_given(config):
    return ("drop",) if config.start == "fixed-point" else ()


GRAPH = Graph(
    Stage("drop", "toy.drop", "Drop a stone.", reads=("gravity", "slope")),
    Stage("roll", "toy.roll", "Roll on.", ("gravity", "start", "strides"), drop_unless_start_is_given, walks=True),
    Stage("bounce", "toy.bounce", "Bounce.", ("contact",), results_of("drop"), needs_contact=True),
    Stage("survey", "toy.survey", "Time it.", ("seed",), has_cells=True),
    Stage("census", "toy.census", "Count the stones.", ("seed",), campaign_of="survey", keeps_parts=True),
    Stage(
        "picture",
        "toy.picture",
        "Draw it.",
        ("name",),
        results_of("drop", "roll", "bounce"),
        if_current=("survey",),
        draws=True,
    ),
    Stage(
        "page",
        "toy.page",
        "Write it up.",
        ("name",),
        results_of("drop", "roll", "bounce", "survey", "picture"),
        if_current=("census",),
        draws=True,
    ),
)
