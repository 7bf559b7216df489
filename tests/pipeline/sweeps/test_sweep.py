"""Tests of a sweep with quick points: which points are computed, which are reused, and what is stored."""

import csv
import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from late_imports import import_late

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.benchmarks.engines import registry
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.planner import Planner
from walkerlab.pipeline.plan.results import FolderResults, Keys, MemoryResults
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.stages.walk import SAMPLE
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import remove_timings
from walkerlab.pipeline.store.files import refused
from walkerlab.pipeline.store.runs import CHUNKS, RunFolder
from walkerlab.pipeline.sweeps import sweep as sweeps
from walkerlab.pipeline.sweeps.chunk import Chunk, PointResult, compute_point, flatten_summary, omit_outputs
from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep
from walkerlab.pipeline.sweeps.result import Merge, as_csv, last_numbers
from walkerlab.views.report.sweep_page import summary_lines

xr = import_late("xarray")

GRAVITIES = "gravity_m_s2=1:9:5"


def opened(swept):
    return xr.open_dataset(swept.path, engine="h5netcdf")


def test_every_value_of_the_stage_is_a_variable_over_the_parameters(toy):
    swept = toy.run("drop", GRAVITIES, "walker.hip_mass_kg=[1, 2]")
    assert (swept.summary["done"], swept.failed, swept.reused) == (10, 0, 0)
    with opened(swept) as dataset:
        assert dataset.period_s.dims == ("gravity_m_s2", "hip_mass_kg")
        assert dataset.gravity_m_s2.values.tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
        assert dataset.hip_mass_kg.attrs["units"] == "kg"
        assert dataset.period_s.attrs == {"units": "s", "long_name": "duration of the fall"}
        assert dataset.speed_m_s.attrs["units"] == "m/s"
        assert float(dataset.period_s.sel(gravity_m_s2=9.0, hip_mass_kg=1)) == math.sqrt(2 / 9)
        assert dataset["losses_J.ground"].values.tolist() == [[1.0, 2.0]] * 5
        assert dataset.bounces.dtype == np.int64
        assert dataset.stable.dtype == bool
        assert dataset.state.dims == ("gravity_m_s2", "hip_mass_kg", "state_index")
        assert dataset.found_by.values[0, 0] == "looking; asking"
        assert dataset["rows.0.error"].values.tolist() == [[0.5, 0.5]] * 5
        assert not [name for name in dataset if "wall_s" in name or "left_out" in name]


def test_row_of_a_sweep_equals_the_result_of_its_config(toy):
    swept = toy.run("roll", GRAVITIES, "strides=[2, 3]")
    config = toy.sweep("roll", GRAVITIES, "strides=[2, 3]").config(7)
    report = execute(config, "roll", RunFolder(toy.runs / "elsewhere", "one"), graph=toy.graph)
    assert swept.content[""]["way_m"].ravel()[7] == report.summary["way_m"]
    assert set(swept.content[""]["outcome"].ravel()) == {"walked"}


def test_rows_of_failed_points_state_the_reason(toy):
    swept = toy.run("drop", "slope_rad=[0.1, 0.35, 1.2]")
    assert (swept.summary["done"], swept.failed) == (3, 0)
    with opened(swept) as dataset:
        assert dataset.outcome.values.tolist() == ["answered", "answered", "no-answer"]
        assert str(dataset.reason.values[2]) == "too steep: 1.2"
        assert np.isnan(dataset.period_s.values).tolist() == [False, False, True]
        assert dataset.bounces.values.tolist() == [3, 3, 0]
        assert np.isfinite(dataset.slips_m).sum("slips_m_index").values.tolist() == [2, 4, 0]
    needing = toy.run("roll", "slope_rad=[0.1, 1.2]")
    assert needing.content[""]["reason"].tolist() == ["", "it needs drop: too steep: 1.2"]


WALKED_AGAIN = ("gravity_m_s2=1.62",)  # Other settings than in other tests, so that nothing is shared with them.


def plain(sentences):
    """Return sentences with ordinary spaces."""
    return [" ".join(sentence.split()) for sentence in sentences]


def test_evenly_spread_sample_of_walks_is_recomputed(toy):
    swept = toy.run("roll", "strides=1:40:40", sets=WALKED_AGAIN)
    again = np.isfinite(swept.content[""]["numerical_error.end_time_s"])
    assert again.sum() == SAMPLE
    assert again[[0, -1]].all()
    # Of forty points sixteen are recomputed, which is every second or third.
    assert np.diff(np.flatnonzero(again)).max() <= 3
    told = {"walked_again": 16, "of": 40, "ended_otherwise": 0, "end_time_s": 1e-9, "step_period_s": 0.04}
    assert swept.summary["numerical_error"] == pytest.approx(told)
    assert plain(summary_lines(swept.summary)) == [
        "Largest numerical error: 0.04 s in period and 10⁻⁹ s in end time, by a second walk with a hundred times "
        "tighter tolerances; 16 of 40 points were recomputed."
    ]


def test_every_point_of_a_small_sweep_is_recomputed_for_its_error(toy):
    swept = toy.run("roll", "strides=[5, 7, 8]", sets=WALKED_AGAIN)
    error = swept.summary["numerical_error"]
    assert (error["walked_again"], error["of"], error["ended_otherwise"]) == (3, 3, 1)
    assert summary_lines(swept.summary)[0].endswith("3 of 3 points were recomputed, of which 1 had another outcome.")
    unknown = toy.run("roll", "strides=[7]", sets=WALKED_AGAIN).summary
    assert summary_lines(unknown)[0].startswith("Numerical errors are unknown; 1 of 1 points")


def test_sweep_reports_contact_walks_ended_by_pads():
    question = build_sweep("contact-sim", [axis_of_text("contact.stiffness=[1e5, 2e5, 3e5]")])
    rows = {
        "0": {"outcome": "off-pad", "pitch_m": 0.37, "step_lengths_m": [0.36, 0.35]},
        "1": {"outcome": "off-pad", "pitch_m": 0.3, "step_lengths_m": [0.4]},
        "2": {"outcome": "walked", "pitch_m": 0.5, "step_lengths_m": [0.5, 0.5, 0.5]},
    }
    found = [PointResult(key, "answered", "", json.dumps(row)) for key, row in rows.items()]
    over_pitch = build_sweep("contact-sim", [axis_of_text("contact.pad_pitch=[0.3, 0.37, 0.5]")])
    both = [Merge(one, load().config, np.arange(3)) for one in (question, over_pitch)]
    for merge in both:
        merge.put(Chunk(tuple(found), {}), {key: int(key) for key in rows})
    (ended,), (of_pitches,) = (merge.endings() for merge in both)
    assert (ended["outcome"], ended["walks"], ended["of"]) == ("off-pad", 2, 3)
    assert "pitch is 0.3 to 0.37 m, the rigid gait's step length; their last steps were 0.35 to 0.4 m" in ended["said"]
    assert "the rigid gait's" not in of_pitches["said"]


def test_stage_without_walks_has_no_numerical_error(toy):
    summary = toy.run("drop", GRAVITIES).summary
    assert "numerical_error" not in summary
    assert summary_lines(summary) == []


def test_nothing_is_computed_twice(toy, marks):
    toy.run("drop", GRAVITIES)
    assert marks() == 5
    assert toy.run("drop", GRAVITIES).reused == 5
    more = toy.run("drop", "gravity_m_s2=1:9:9")
    assert (more.reused, more.summary["done"]) == (5, 9)
    assert marks() == 9
    other_run = toy.run("drop", GRAVITIES, sets=["strides=7"])
    assert other_run.path.parent.name == "paper@strides=7"
    assert other_run.reused == 5
    assert marks() == 9


def test_points_that_differ_only_in_parameters_the_stage_does_not_read_are_computed_once(toy, marks):
    notes = []
    reporter = type("Listener", (sweeps.Silent,), {"note": lambda self, text: notes.append(text)})()
    swept = toy.run("drop", GRAVITIES, "strides=[2, 3, 4]", reporter=reporter)
    assert swept.summary["done"] == 15
    assert marks() == 5
    assert any("drop does not read strides" in note for note in notes)


def test_result_of_a_single_run_is_reused(toy, marks):
    config = toy.sweep("drop", GRAVITIES).config(2)
    execute(config, "drop", RunFolder(toy.runs, "alone"), graph=toy.graph)
    assert marks() == 1
    assert toy.run("drop", GRAVITIES).reused == 1
    assert marks() == 5


def test_sweep_keys_equal_those_of_the_pipeline(toy):
    config = toy.sweep("roll", GRAVITIES).config(1)
    report = execute(config, "roll", RunFolder(toy.runs, "alone"), graph=toy.graph)
    keys = Keys(toy.graph).compute_keys(config, "roll")
    assert keys == {name: artifact.read(toy.runs / "alone" / f"{name}.h5").identity.key for name in ("drop", "roll")}
    assert report.summary == answer_in_memory(config, "roll", MemoryResults(toy.graph)).summary


@pytest.mark.parametrize("name", ["paper", "round-feet", "kneed"])
def test_sweep_point_has_the_same_key_as_a_single_run(name, tmp_path):
    loaded = load(Path(name))
    stages = [stage for stage in PIPELINE.stages if not stage.draws and stage.why_unsuited(loaded.config) is None]
    folder = RunFolder(tmp_path, loaded.run_name)
    steps = Planner(loaded.config, FolderResults(folder), stages).plan()
    single = {step.stage.name: step.identity.key for step in steps}
    assert {stage.name: Keys().compute_keys(loaded.config, stage.name)[stage.name] for stage in stages} == single


def test_engine_version_changes_only_the_key_of_the_engines_stage(monkeypatch):
    config = load().config
    monkeypatch.setattr(registry, "installed", lambda: (registry.Engine("absent", "absent"),))
    keys = []
    for version in ("1.0", "1.1"):
        monkeypatch.setattr(registry.Engine, "version", version)
        keys.append(Keys().compute_keys(config, "engines"))
    assert [name for name in keys[0] if keys[0][name] != keys[1][name]] == ["engines"]


def test_shared_inputs_of_points_are_computed_once(toy, marks):
    toy.run("roll", "strides=2:9:8")
    assert marks() == 1


def test_damaged_chunk_is_recomputed(toy, marks):
    first = toy.run("drop", GRAVITIES)
    chunks = sorted((toy.runs / "paper" / CHUNKS).iterdir())
    for path in chunks:
        path.write_bytes(path.read_bytes()[:-1])
    warnings = []
    reporter = type("Listener", (sweeps.Silent,), {"warn": lambda self, text: warnings.append(text)})()
    again = toy.run("drop", GRAVITIES, reporter=reporter)
    assert again.reused == 0
    assert [warning.partition(" is damaged: ")[0] for warning in warnings] == [str(path) for path in chunks]
    assert again.content.digest() == first.content.digest()
    assert marks() == 5  # The same points were computed in the same process.


@pytest.mark.parametrize("why", [refused(Path("x"), OSError(28, "No space left on device")), KeyboardInterrupt()])
def test_interrupted_sweep_resumes_with_bitwise_equal_results(toy, tmp_path, monkeypatch, why):
    whole = toy.run("drop", "gravity_m_s2=1:9:40").content.digest()
    toy.runs = tmp_path / "again"
    kept, notes = [], []
    reporter = type("Listener", (sweeps.Silent,), {"note": lambda self, text: notes.append(text)})()

    def stopped(folder, *rest):
        if len(kept) == 2:
            raise why
        kept.append(store(folder, *rest))

    store = sweeps.store
    monkeypatch.setattr(sweeps, "store", stopped)
    with pytest.raises(type(why)):
        toy.run("drop", "gravity_m_s2=1:9:40", chunk_s=1e-9, reporter=reporter)
    monkeypatch.setattr(sweeps, "store", store)
    resumed = toy.run("drop", "gravity_m_s2=1:9:40")
    assert 0 < resumed.reused < 40
    assert resumed.content.digest() == whole
    told = [f"sweep: interrupted; {resumed.reused} of 40 points are kept"]
    assert notes == (told if isinstance(why, KeyboardInterrupt) else [])


def test_bad_points_are_reported_before_anything_runs(toy, marks):
    with pytest.raises(ConfigError) as caught:
        toy.run("drop", "gravity_m_s2=[1, -2, 3]", "walker.hip_mass_kg=[1, -7]")
    assert "at gravity_m_s2=-2, walker.hip_mass_kg=1" in caught.value.message
    assert "walker.hip_mass_kg: -7 is out of bounds" in caught.value.message
    assert marks() == 0
    assert not toy.runs.exists()


def test_sweep_of_a_stage_with_checkpoints_leaves_no_checkpoint_file(toy):
    swept = toy.run("count", "seed=[2, 3, 4]")
    assert swept.content[""]["total"].tolist() == [1.0, 3.0, 6.0]
    assert not list(toy.runs.rglob("*.parts"))


def test_only_stages_without_files_can_be_swept(toy):
    with pytest.raises(ConfigError, match="cannot be swept"):
        toy.sweep("picture", GRAVITIES)


def test_parameters_of_sampled_points_are_stored_as_coordinates_along_the_points(toy):
    swept = toy.run("drop", "gravity_m_s2=1:9", "walker.hip_mass_kg=1:5", sample="latin-hypercube:6", seed=2)
    with opened(swept) as dataset:
        assert dataset.period_s.dims == ("point",)
        assert set(dataset.coords) == {"gravity_m_s2", "hip_mass_kg"}
        assert dataset.period_s.values == pytest.approx(np.sqrt(2 / dataset.gravity_m_s2.values), rel=1e-15)


def test_dry_run_states_finished_points_and_the_remaining_time(toy):
    toy.run("drop", GRAVITIES)
    foreseen = toy.sweep("drop", "gravity_m_s2=1:9:9").foresee(workers=2, max_points=3)
    assert (foreseen.count, foreseen.there) == (9, 5)
    assert foreseen.points == ("gravity_m_s2=1.0", "gravity_m_s2=2.0", "gravity_m_s2=3.0")
    assert 0.0 < foreseen.estimate_s < 1.0
    unknown = toy.sweep("roll", GRAVITIES).foresee(2, 1)
    assert unknown.estimate_s is None


def test_table_has_a_row_for_each_point(toy):
    swept = toy.run("drop", "slope_rad=[0.1, 1.2]", "gravity_m_s2=[2, 8]")
    rows = list(csv.DictReader(io.StringIO(as_csv(swept.content, swept.question))))
    assert [(row["slope_rad"], row["gravity_m_s2"]) for row in rows] == [
        ("0.1", "2"),
        ("0.1", "8"),
        ("1.2", "2"),
        ("1.2", "8"),
    ]
    assert [row["period_s"] for row in rows] == ["1.0", "0.5", "", ""]


def test_table_shows_headline_values_unless_all_are_requested(toy):
    swept = toy.run("drop", "gravity_m_s2=[2, 8]")
    short, whole = (
        list(csv.DictReader(io.StringIO(as_csv(swept.content, swept.question, every)))) for every in (False, True)
    )
    assert "state_1" not in short[0]
    assert whole[0]["state_1"] == "1.0"
    assert short[0].keys() < whole[0].keys()


def test_last_step_of_each_walk_is_found_even_if_some_walks_end_earlier():
    last = last_numbers(np.array([[0.7, 0.8], [0.6, np.nan], [np.nan, np.nan]]))
    assert last[:2].tolist() == [0.8, 0.6]
    assert np.isnan(last[2])


def test_sweep_file_records_its_question(toy):
    swept = toy.run("drop", GRAVITIES)
    stored = artifact.read(swept.path)
    assert stored.summary["parameters"] == {"gravity_m_s2": [1.0, 3.0, 5.0, 7.0, 9.0]}
    assert stored.identity.config_slice["over"] == {"gravity_m_s2": [1.0, 3.0, 5.0, 7.0, 9.0]}
    assert json.dumps(stored.summary["outcomes"]) == '{"answered": 5}'
    assert stored.digest() == swept.content.digest()


@pytest.mark.parametrize("stage", ["simulate", "contact-sim"])
def test_walk_in_a_sweep_has_the_summary_of_a_single_walk(stage):
    config = load(sets=("strides=1",)).config
    (row,) = compute_point(config, "key", PIPELINE, stage, again=True).rows
    alone = answer_in_memory(config, stage, MemoryResults())
    assert "trajectory" in alone.groups
    assert json.loads(row.numbers) == flatten_summary(remove_timings(alone.summary, alone.timed))


def test_arrays_needed_by_another_stage_are_kept():
    config = load().config
    assert omit_outputs(config, "compare", PIPELINE) == config
    assert omit_outputs(config, "contact-sim", PIPELINE).outputs == ()
