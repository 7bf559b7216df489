"""Error against run time on the rigid scene, a few methods: what the rows say, and what is computed from them."""

from dataclasses import replace

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.scene.references import WalkEndsError, reference_for
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.trials import USER_SCRIPT, RigidTrial, TrialRun
from walkerlab.stages import accuracy
from walkerlab.stages.accuracy import Row, best_methods, climb, conclusion, measure, rows_group, summary_of

CONFIG = load(None, ("contact=null",)).config
START = (-0.20420, 0.16940, 0.98 * -0.605819, 0.98 * -0.861041)
FEW = ("dop853", "radau5", "scipy-dop853", USER_SCRIPT)
TRIAL = RigidTrial(rigid_walker(CONFIG, CONFIG.equations), START, 3)
LADDER = (1e-4, 1e-7, 1e-10)


@pytest.fixture(scope="module")
def reference():
    return reference_for(TRIAL)


@pytest.fixture(scope="module")
def rows(reference):
    return [measure(TRIAL, method, rtol, 10**5, reference) for method in FEW for rtol in LADDER]


def test_the_reference_is_known_to_rounding_and_by_two_ways(reference):
    assert reference.method != reference.second_method
    assert reference.agreement < 1e-13


def test_every_method_converges_to_the_reference(rows):
    for method in FEW:
        errors = [row.error for row in rows if row.method == method]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 1e-8


def test_our_compiled_methods_and_scipys_agree_to_what_the_tolerances_promise(rows):
    tightest = {row.method: row.error for row in rows if row.tolerance == LADDER[-1]}
    assert max(tightest.values()) < 100 * LADDER[-1]


def test_a_script_with_numpy_needs_the_work_of_the_same_method(rows):
    work = {row.method: row.rhs_evaluations for row in rows if row.tolerance == 1e-7}
    assert 0.5 * work["scipy-dop853"] < work[USER_SCRIPT] <= work["scipy-dop853"]


def test_content_is_the_same_each_time_apart_from_timings(reference, rows):
    again = measure(TRIAL, "dop853", 1e-7, 10**5, reference)
    first = next(row for row in rows if row.method == "dop853" and row.tolerance == 1e-7)
    timings = {"wall_s": 0.0, "least_wall_s": 0.0, "repeats_of_wall_s": 0}
    assert replace(again, **timings) == replace(first, **timings)


def test_timings_are_marked_as_such(rows):
    variables = rows_group(rows).variables
    assert {name for name, variable in variables.items() if variable.timing} == {"wall_s", "least_wall_s", "repeats"}


def test_an_exhausted_budget_stays_visible_and_ends_the_ladder(reference, monkeypatch):
    monkeypatch.setattr(accuracy, "BUDGET", 500)
    measured, not_run = climb(TRIAL, "radau5", reference)
    assert [row.outcome for row in measured[:-1]] == ["walked"] * (len(measured) - 1)
    assert (measured[-1].outcome, measured[-1].error) == ("budget-exhausted", None)
    assert len(measured) + len(not_run) == len(accuracy.OWN_LADDER)
    assert all("budget-exhausted" in entry["why"] for entry in not_run)


class SlowAtFirst:
    """A trial whose first run of all takes much longer, as one that compiles does."""

    name, methods = "rigid", ("dop853",)

    def __init__(self):
        self.clock, self.runs = 0.0, 0

    def prepare(self, method, rtol, budget):
        return self.run

    def run(self):
        self.clock += 1e-3 if self.runs else 60.0
        self.runs += 1
        return TrialRun("walked", np.zeros(4), 1, 1, 0)


def test_compiling_is_not_measured(reference, monkeypatch):
    trial = SlowAtFirst()
    monkeypatch.setattr(accuracy.time, "perf_counter", lambda: trial.clock)
    measured, _ = climb(trial, "dop853", reference)
    assert [row.wall_s for row in measured] == pytest.approx([1e-3] * len(accuracy.OWN_LADDER))
    assert {row.repeats_of_wall_s for row in measured} == {accuracy.REPEATS}


def made(method, error, wall_s):
    return Row("rigid", method, 1e-6, "walked", error, wall_s, wall_s, 7, 100, 10, 0)


MADE = [
    made("dop853", 1e-4, 1.0),
    made("dop853", 1e-10, 3.0),
    made("radau5", 1e-7, 2.0),
    made("scipy-bdf", 1e-7, 8.0),
    made("scipy-lsoda", None, 0.1),
]


def test_the_best_is_the_fastest_that_is_exact_enough():
    assert best_methods(MADE, "rigid") == {"1e-3": "dop853", "1e-6": "radau5", "1e-9": "dop853"}
    assert best_methods(MADE, "contact") == {}


def test_the_conclusion_compares_with_the_best_library():
    said = conclusion(MADE, "rigid")
    assert "at 1e-06, radau5 is fastest with 2e+03 ms, 4 times faster than scipy-bdf" in said
    assert "no method reaches" not in said


def test_the_summary_has_the_fixed_keys(rows, reference):
    summary = summary_of(rows, [], {"rigid": reference})
    assert {"rows", "repeats", "reference", "best"} <= summary.keys()
    fixed = {"scene", "method", "tolerance", "error", "wall_s", "rhs_evaluations", "accepted", "rejected", "outcome"}
    assert fixed <= summary["rows"][0].keys()
    assert {"method", "second_method", "agreement", "state"} <= summary["reference"]["rigid"].keys()


def test_a_walk_that_ends_early_has_no_reference():
    lying = replace(TRIAL, start=(-1.6, 1.6, 0.0, 0.0))
    with pytest.raises((WalkEndsError, ValueError)):
        reference_for(lying)
