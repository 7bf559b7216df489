"""Tests of the stage `accuracy`: errors and run times of a few methods on the rigid scene, and its conclusions."""

from dataclasses import replace

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.evidence.benchmarks import accuracy
from walkerlab.evidence.benchmarks.accuracy import (
    Ascent,
    MethodRow,
    MethodRun,
    ascend,
    best_methods,
    conclusion,
    make_row,
    measure,
    omitted_tolerances,
    summarise,
)
from walkerlab.evidence.benchmarks.references import (
    End,
    Reference,
    WalkEndsError,
    first_end,
    reference_for,
    walk_by_taylor,
)
from walkerlab.evidence.benchmarks.trials import USER_SCRIPT, RigidTrial, TrialRun
from walkerlab.evidence.paper.appendix_a import compass
from walkerlab.labels import labels_of
from walkerlab.pipeline.store.content import rows_group
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene.rigid import rigid_walker

CONFIG = load(None, ("contact=null",)).config
START = (-0.20420, 0.16940, 0.98 * -0.605819, 0.98 * -0.861041)
FEW = ("dop853", "radau5", "scipy-dop853", USER_SCRIPT)
TRIAL = RigidTrial(rigid_walker(CONFIG, CONFIG.equations), START, 3, compass(CONFIG, CONFIG.equations))
LADDER = (1e-4, 1e-7, 1e-10)


@pytest.fixture(scope="module")
def reference():
    return reference_for(TRIAL)


def measured(method, rtol, reference):
    one = Ascent(TRIAL, method, LADDER, ())
    return make_row(one, measure(TRIAL, method, rtol, 10**5), reference)


@pytest.fixture(scope="module")
def rows(reference):
    return [measured(method, rtol, reference) for method in FEW for rtol in LADDER]


def test_two_methods_agree_on_the_reference_to_rounding(reference):
    assert reference.first.method != reference.second.method
    assert reference.agreement < 1e-13


def test_reference_without_taylor_series_is_also_computed_by_two_methods():
    """Neither of them is the Taylor method, whose closed form is for a compass only."""
    reference = reference_for(replace(TRIAL, compass=None, steps=1))
    assert {reference.first.method, reference.second.method} == {"dop853", "radau5"}
    assert reference.agreement < 1e-10


def test_taylor_walk_whose_state_overflows_has_no_end_state():
    pytest.importorskip("heyoka")
    assert walk_by_taylor(TRIAL.compass, (-0.2, 0.17, 0.0, 1e200), 1) is None


def test_every_method_converges_to_the_reference(rows):
    for method in FEW:
        errors = [row.error for row in rows if row.method == method]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 1e-8


def test_compiled_and_scipy_methods_agree_within_tolerance(rows):
    tightest = {row.method: row.error for row in rows if row.tolerance == LADDER[-1]}
    assert max(tightest.values()) < 100 * LADDER[-1]


def test_numpy_script_needs_no_more_evaluations_than_scipy_dop853(rows):
    work = {row.method: row.rhs_evaluations for row in rows if row.tolerance == 1e-7}
    assert 0.5 * work["scipy-dop853"] < work[USER_SCRIPT] <= work["scipy-dop853"]


def test_content_is_reproducible_apart_from_timings(reference, rows):
    again = measured("dop853", 1e-7, reference)
    first = next(row for row in rows if row.method == "dop853" and row.tolerance == 1e-7)
    timings = {"wall_s": 0.0, "least_wall_s": 0.0, "largest_wall_s": 0.0, "repeats_of_wall_s": 0}
    assert replace(again, **timings) == replace(first, **timings)


def test_timings_are_marked_as_timings(rows):
    variables = rows_group(rows, labels_of(MethodRow)).variables
    timings = {"wall_s", "least_wall_s", "largest_wall_s", "repeats"}
    assert {name for name, variable in variables.items() if variable.timing} == timings


def test_no_method_is_compared_with_its_own_result(rows, reference):
    assert all(row.against != row.method for row in rows)
    near = Reference(End("dop853", np.zeros(4)), End("radau5", np.full(4, 1e-12)))
    assert near.agreement == 1e-12
    assert near.reference_for("dop853").method == "radau5"
    assert {near.reference_for(method).method for method in ("radau5", "scipy-radau")} == {"dop853"}


def test_error_below_the_uncertainty_of_the_reference_is_marked():
    unsure = Reference(End("heyoka-taylor", np.zeros(4)), End("dop853", np.full(4, 1e-8)))
    ends = {1e-4: 2e-8, 1e-8: 1e-9}
    climbed = Ascent(TRIAL, "radau5", tuple(ends), ())
    runs = [MethodRun(rtol, TrialRun("walked", np.full(4, end), 1, 1, 0), (1.0,)) for rtol, end in ends.items()]
    assert [make_row(climbed, run, unsure).within_reference for run in runs] == [False, True]


def test_exhausted_budget_is_shown_and_ends_the_series_of_tolerances(reference, monkeypatch):
    monkeypatch.setattr(accuracy, "RUN_BUDGET", 500)
    one = ascend(TRIAL, "radau5", Checkpoint(None, ""))
    rows = [make_row(one, run, reference) for run in one.runs]
    assert [row.outcome for row in rows[:-1]] == ["walked"] * (len(rows) - 1)
    assert (rows[-1].outcome, rows[-1].error, rows[-1].within_reference) == ("budget-exhausted", None, False)
    not_run = omitted_tolerances(one)
    assert len(rows) + len(not_run) == len(accuracy.OWN_LADDER)
    assert all("budget-exhausted" in entry["why"] for entry in not_run)


def test_series_of_a_library_method_ends_at_its_first_exhausted_budget(reference, monkeypatch):
    sizes = [run.result.rhs_evaluations for run in ascend(TRIAL, "scipy-dop853", Checkpoint(None, "")).runs]
    monkeypatch.setattr(accuracy, "LIBRARY_RUN_BUDGET", sizes[2] - 1)
    monkeypatch.setattr(accuracy, "LAST_RUN_SIZE", sizes[1] + 1)
    library, ours = (ascend(TRIAL, method, Checkpoint(None, "")) for method in ("scipy-dop853", "dop853"))
    rows = [make_row(library, run, reference) for run in library.runs]
    assert [row.outcome for row in rows] == ["walked", "walked", "budget-exhausted"]
    assert [row.rhs_evaluations for row in rows[:2]] == sizes[:2]
    assert len(omitted_tolerances(library)) == len(accuracy.LIBRARY_LADDER) - 3
    assert len(ours.runs) == len(accuracy.OWN_LADDER)


class StopsAfter:
    """A trial that is stopped after some runs, as Ctrl-C does."""

    name, methods, steps = "rigid", ("dop853",), TRIAL.steps

    def __init__(self, runs):
        self.left = runs

    def prepare(self, method, rtol, budget):
        run = TRIAL.prepare(method, rtol, budget)

        def counted_run():
            self.left -= 1
            if self.left < 0:
                raise KeyboardInterrupt
            return run()

        return counted_run


def test_interrupted_measurement_resumes_with_its_finished_runs(tmp_path):
    path = tmp_path / "accuracy.parts"
    with pytest.raises(KeyboardInterrupt):
        ascend(StopsAfter(30), "dop853", Checkpoint(path, "key"))
    finished = Checkpoint(path, "key").kept
    assert 1 <= len(finished) < len(accuracy.OWN_LADDER)
    resumed = ascend(TRIAL, "dop853", Checkpoint(path, "key"))
    assert [run.pack() for run in resumed.runs[: len(finished)]] == list(finished.values())
    fresh = ascend(TRIAL, "dop853", Checkpoint(None, ""))
    for run, same in zip(resumed.runs, fresh.runs, strict=True):
        assert (run.tolerance, run.result.outcome) == (same.tolerance, same.result.outcome)
        assert run.result.state.tolist() == same.result.state.tolist()
        assert run.result.rhs_evaluations == same.result.rhs_evaluations


def test_interrupted_measurement_keeps_its_references(tmp_path):
    path = tmp_path / "accuracy.parts"
    end = accuracy.resumed_end(TRIAL, "first end", first_end, Checkpoint(path, "key"))
    assert accuracy.resumed_end(TRIAL, "first end", None, Checkpoint(path, "key")).pack() == end.pack()


class SlowAtFirst:
    """A trial whose very first run takes much longer, as if it compiled."""

    name, methods = "rigid", ("dop853",)

    def __init__(self):
        self.clock, self.runs = 0.0, 0

    def prepare(self, method, rtol, budget):
        return self.run

    def run(self):
        self.clock += 1e-3 if self.runs else 60.0
        self.runs += 1
        return TrialRun("walked", np.zeros(4), 1, 1, 0)


def test_compilation_is_not_timed(reference, monkeypatch):
    trial = SlowAtFirst()
    monkeypatch.setattr(accuracy.time, "perf_counter", lambda: trial.clock)
    ascent = ascend(trial, "dop853", Checkpoint(None, ""))
    rows = [make_row(ascent, run, reference) for run in ascent.runs]
    assert [row.wall_s for row in rows] == pytest.approx([1e-3] * len(accuracy.OWN_LADDER))
    assert {row.repeats_of_wall_s for row in rows} == {accuracy.MAX_REPEATS}


def made(method, error, wall_s):
    work = 1600 if method.startswith("scipy") else 800
    walls = wall_s, 0.9 * wall_s, 1.2 * wall_s
    return MethodRow("rigid", method, 1e-6, "walked", error, "heyoka-taylor", False, *walls, 7, work, 10, 0)


MADE = [
    made("dop853", 1e-4, 1.0),
    made("dop853", 1e-10, 3.0),
    made("radau5", 1e-7, 2.0),
    made("scipy-bdf", 1e-7, 8.0),
    made("scipy-lsoda", None, 0.1),
]


def test_best_method_is_the_fastest_that_is_accurate_enough():
    assert best_methods(MADE, "rigid") == {"1e-3": "dop853", "1e-6": "radau5", "1e-9": "dop853"}
    assert best_methods(MADE, "contact") == {}


def test_conclusion_compares_the_best_method_with_the_best_library():
    said = conclusion(MADE, "rigid")
    assert "at 1e-06, radau5 is fastest with 2e+03 ms, 4 times faster than scipy-bdf" in said
    assert "no method reaches" not in said


def test_speedup_over_a_library_is_split_into_work_and_cost_per_evaluation():
    said = conclusion(MADE, "rigid")
    # 1600 against 800 right-hand sides, 8 s against 2 s: twice as many, each twice as costly
    factors = "2 times fewer right-hand sides, each 2 times cheaper: 2500 µs instead of 5000 µs"
    assert factors in said
    assert "the steps of the library run in Python" in said
    more = [made("dop853", 1e-10, 2.0), replace(made("scipy-bdf", 1e-10, 8.0), rhs_evaluations=400)]
    assert "2 times more right-hand sides, each 8 times cheaper" in conclusion(more, "rigid")


def test_speedup_is_not_computed_against_the_numpy_script():
    script = [made("dop853", 1e-4, 1.0), made(USER_SCRIPT, 1e-4, 5.0), made("scipy-bdf", 1e-4, 8.0)]
    assert "8 times faster than scipy-bdf" in conclusion(script, "rigid")


def test_reference_states_its_method_and_cost(reference):
    summary = summarise([], [], {"rigid": reference})["reference"]["rigid"]
    assert summary["from_outside"] == (reference.first.method == "heyoka-taylor")
    ours = reference_for(replace(TRIAL, compass=None, steps=1))
    told = summarise([], [], {"rigid": ours})["reference"]["rigid"]
    assert not told["from_outside"]
    assert told["tolerance"] == 1e-14
    assert told["rhs_evaluations"] == ours.first.rhs_evaluations > 100


def test_summary_has_the_expected_keys(rows, reference):
    summary = summarise(rows, [], {"rigid": reference})
    assert {"rows", "repeats", "reference", "best"} <= summary.keys()
    fixed = {"scene", "method", "tolerance", "error", "wall_s", "rhs_evaluations", "accepted", "rejected", "outcome"}
    assert fixed <= summary["rows"][0].keys()
    assert summary["rigid_velocity_factor"] == 0.98
    assert {"method", "second_method", "agreement", "state"} <= summary["reference"]["rigid"].keys()


def test_walk_that_ends_early_has_no_reference():
    lying = replace(TRIAL, start=(-1.6, 1.6, 0.0, 0.0))
    with pytest.raises((WalkEndsError, ValueError)):
        reference_for(lying)


def test_early_end_is_explained_by_a_start_off_the_gait():
    entry = accuracy.omitted_scene(RigidTrial(None, None, 1, None), WalkEndsError("the walk ends early (fell)"))
    assert entry["why"] == "started with velocities scaled by 0.98, the walk ends early (fell)"
