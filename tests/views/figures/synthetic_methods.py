"""Run times and errors of methods set by hand, in the layout that `accuracy` stores."""

from synthetic_maps import stability_maps
from synthetic_walks import both_models, stored

from walkerlab.evidence.benchmarks.accuracy import MethodRow
from walkerlab.labels import labels_of
from walkerlab.pipeline.store.content import rows_group

SCENES = ("rigid", "contact", "contact-near-rigid")
# method, tolerance, outcome, error, run time s, right-hand sides
RUNS = (
    ("dop853", 1e-3, "walked", 3e-5, 5e-5, 700),
    ("dop853", 1e-9, "walked", 7e-11, 9e-5, 2000),
    ("dop853", 1e-12, "walked", 1e-17, 2e-4, 3700),
    ("radau5", 1e-3, "walked", 3e-5, 1e-4, 700),
    ("radau5", 1e-9, "walked", 7e-13, 4e-3, 15000),
    ("scipy-rk45", 1e-3, "walked", 4e-4, 9e-3, 300),
    ("scipy-rk45", 1e-9, "budget-exhausted", None, 0.6, 50000),
    ("scipy-bdf", 1e-3, "slid", None, 0.3, 4000),
    ("scipy-bdf", 1e-9, "walked", 4e-9, 0.5, 3500),
    ("a-new-method", 1e-3, "walked", 4e-3, 0.02, 6000),
)


def rows():
    made = [
        MethodRow("rigid", method, tolerance, outcome, error, "dop853", False, wall_s, wall_s, wall_s, 1, work, work, 0)
        for method, tolerance, outcome, error, wall_s, work in RUNS
    ]
    return rows_group(made, labels_of(MethodRow))


def measured(scenes=SCENES):
    reference = {"method": "heyoka-taylor", "second_method": "dop853", "agreement": 9e-16, "state": [0.0] * 4}
    summary = {
        "reference": dict.fromkeys(scenes, reference),
        "conclusions": {scene: f"{scene}: at 1e-06, dop853 is fastest." for scene in scenes},
    }
    return stored("accuracy", {f"{scene}/rows": rows() for scene in scenes}, summary)


def measured_methods(scenes=SCENES):
    return {"accuracy": measured(scenes)}


def everything():
    return both_models(**measured_methods(), **stability_maps())
