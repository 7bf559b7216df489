"""A family of gaits set by hand: a gait of one step that doubles its period at a slope of 4."""

import numpy as np
from synthetic_walks import stored

from walkerlab.pipeline.store.content import Group, Variable

FLIP, END = 4.0, 5.0


def branch(period, value, stable, spread, marks):
    """Return a branch with steps whose periods differ by `spread`. `marks` has index, value and spread of flips."""
    points, steps = value.size, np.linspace(-1.0, 1.0, period) if period > 1 else np.zeros(1)
    sizes = {"step_period": (0.7, "s"), "stance_angle": (0.2, "rad")}
    variables = {
        "value": Variable(value, ("point",), "deg", "slope_deg"),
        "stable": Variable(stable, ("point",), "1", "stable"),
        "multiplier_real": Variable(np.linspace(0.5, -1.5, points)[:, None], ("point", "multiplier"), "1", "real"),
        "multiplier_imag": Variable(np.zeros((points, 1)), ("point", "multiplier"), "1", "imaginary"),
        "mark_after": Variable(np.array([m[0] for m in marks]), ("mark",), "1", "after"),
        "mark_value": Variable(np.array([m[1] for m in marks]), ("mark",), "deg", "value"),
        "mark_kind": Variable(np.array(["flip" for _ in marks], object), ("mark",), "", "kind"),
    }
    for name, (middle, unit) in sizes.items():
        variables[name] = Variable(middle + spread[:, None] * steps, ("point", "step"), unit, name)
        marked = np.array([m[2] for m in marks])
        variables[f"mark_{name}"] = Variable(middle + marked[:, None] * steps, ("mark", "step"), unit, name)
    return Group(variables, {"period": period, "begins": "start", "ends": "end of the span"})


def families(curves=True, flips=True):
    """Return the result of `continuation` as figures see it. Without flips it has only its gait of one step."""
    one = np.array([1.0, 3.0, 4.5, END])
    two = np.array([4.2, 4.6, END])
    groups = {
        "branches": Group(
            {
                "model": Variable(np.array(["rigid", "rigid"]), ("branch",), "", "model"),
                "period": Variable(np.array([1, 2]), ("branch",), "1", "period"),
                "from": Variable(np.array([1.0, FLIP]), ("branch",), "deg", "from"),
                "to": Variable(np.array([END, END]), ("branch",), "deg", "to"),
            }
        ),
        "rigid/branch_0": branch(1, one, np.array([True, True, False, False]), np.zeros(4), [(1, FLIP, 0.0)]),
        "rigid/branch_1": branch(2, two, np.full(3, True), 0.1 * np.sqrt(two - FLIP), [(-1, FLIP, 0.0)]),
        "rigid/attractor": Group(
            {
                "value": Variable(np.array([4.7]), ("sample",), "deg", "slope_deg"),
                "step_period": Variable(np.full((1, 4), 0.7), ("sample", "visit"), "s", "step_period"),
                "stance_angle": Variable(np.full((1, 4), 0.2), ("sample", "visit"), "rad", "stance_angle"),
            }
        ),
    }
    if curves:
        plane = {
            "value": Variable(np.array([4.5, FLIP, 3.5]), ("point",), "deg", "slope_deg"),
            "second": Variable(np.array([5.0, 10.0, 20.0]), ("point",), "kg", "walker.hip_mass_kg"),
        }
        groups["rigid/curve_0"] = Group(plane, {"kind": "flip", "period": 1})
        groups["curves"] = Group(
            {
                "model": Variable(np.array(["rigid"]), ("curve",), "", "model"),
                "kind": Variable(np.array(["flip"]), ("curve",), "", "kind"),
                "period": Variable(np.array([1]), ("curve",), "1", "period"),
            }
        )
        groups["rigid/regions"] = Group(
            {
                "value": Variable(np.array([3.0, 4.0, 5.0]), ("first",), "deg", "slope_deg"),
                "second": Variable(np.array([5.0, 15.0]), ("second",), "kg", "walker.hip_mass_kg"),
                "period": Variable(np.array([[1, 1], [1, 2], [0, -1]]), ("first", "second"), "1", "period"),
            }
        )
    summary = {
        "over": "slope_deg",
        "unit": "deg",
        "from": 1.0,
        "to": END,
        "branches": [
            {"model": "rigid", "period": 1, "from": 1.0, "to": END, "points": 4, "stable_range": [1.0, FLIP],
             "stable_ranges": [[1.0, FLIP]], "ends": []},
            {"model": "rigid", "period": 2, "from": FLIP, "to": END, "points": 3, "stable_range": [FLIP, END],
             "stable_ranges": [[FLIP, END]], "ends": []},
        ],
        "bifurcations": [{"kind": "flip", "period": 1, "value": FLIP, "multiplier": [-1.0, 0.0], "model": "rigid"}],
        "first_doubling": {"rigid": FLIP},
        "lyapunov": [{"model": "rigid", "value": 4.7, "exponent": 0.2, "uncertainty": 0.01}],
        "cascades": [],
        "limits": [],
        "attractors": [{"model": "rigid", "from": 3.9, "to": 4.7, "aperiodic_from": 4.7, "lost_at": 4.9,
                        "ended": "fell", "periods": [0, 1]}],
        "curves": [],
    }  # fmt: skip
    if not flips:
        groups = {"branches": groups["branches"], "rigid/branch_0": branch(1, one, np.full(4, True), 0.0 * one, [])}
        summary |= {"bifurcations": [], "attractors": [], "first_doubling": {}}
    return {"continuation": stored("continuation", groups, summary)}
