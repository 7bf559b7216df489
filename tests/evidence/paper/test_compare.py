"""Tests of the comparison of both models, on synthetic results in the layout of other stages."""

import json

import numpy as np
import pytest
from late_imports import import_late
from numpy.testing import assert_allclose

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.evidence.paper import compare
from walkerlab.evidence.paper.study import study_the_paper
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.stages import simulate
from walkerlab.pipeline.stages.walk import step_columns, variables_over_time
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.store.runs import RunFolder

xarray = import_late("xarray")

SLOWER = 1.01
TAKES = PIPELINE["compare"].takes
FIXED_KEYS = {
    "paper_numbers",
    "table3",
    "max_angle_error_rad",
    "max_velocity_error_rad_s",
    "orbit_distance",
}
FIXED_COLUMNS = {"where", "quantity", "printed", "as_printed", "corrected", "contact", "verdict", "evidence"}


@pytest.fixture(scope="module")
def study():
    return study_the_paper()


@pytest.fixture(scope="module")
def gaits(study):
    """Return a result of `fixedpoint` with only the parts that other stages read."""

    def entry(name, model):
        return {
            "state": list(model.state),
            "period_s": model.table_3.t_left,
            "step_length_m": model.step_length,
            "spectral_radius": 0.6,
            "equations": name,
        }

    sets = {"corrected": entry("corrected", study.corrected), "as-printed": entry("as-printed", study.as_printed)}
    return Content({}, {**sets["corrected"], "equation_sets": sets})


def contact_walk(rigid, steps, *leave_out, outcome="walked", samples=None):
    """Return the rigid walk in the layout of a contact walk, slightly slower and without samples at heel strikes."""
    done, trajectory = rigid["steps"], rigid["trajectory"]
    touches = SLOWER * done["touch_time_s"][:steps]
    end = touches[-1] if steps else 0.3
    apart = np.diff(trajectory["time"], append=np.inf) > 1e-9
    apart &= np.diff(trajectory["time"], prepend=-np.inf) > 1e-9
    kept = apart & (SLOWER * trajectory["time"] <= end)
    columns = {
        "time": SLOWER * trajectory["time"],
        "angle": trajectory["angle"],
        "velocity": trajectory["velocity"] / SLOWER,
        "mechanical_J": trajectory["mechanical_J"],
    }
    seen = {name: values[kept][:samples] for name, values in columns.items() if name not in leave_out}
    groups = {"trajectory": Group(variables_over_time(**seen))} | (
        {"steps": Group(step_columns(touches))} if steps else {}
    )
    return Content(
        groups,
        {
            "outcome": outcome,
            "steps": steps,
            "step_periods_s": (SLOWER * done["period_s"][:steps]).tolist(),
            "step_lengths_m": done["length_m"][:steps].tolist(),
            "pitch_m": 0.3714,
            "static_penetration_m": 5.9e-5,
            "damping_ratio": 3.7,
            "slip_per_step_m": 0.0,
            "dissipated_J": {"damping": 1.0},
        },
    )


@pytest.fixture(scope="module")
def compared(gaits):
    """Return the comparison with a contact walk that has this many steps and lacks some of its records."""

    def result(*sets, steps=10, leave_out=(), outcome="walked", samples=None, fixedpoint=gaits):
        config = load(None, sets).config
        rigid = simulate.run(load(None, ["solver.rigid.rtol=1e-9"]).config, {"fixedpoint": gaits}, Silent())
        walk = contact_walk(rigid, steps, *leave_out, outcome=outcome, samples=samples)
        inputs = {"fixedpoint": fixedpoint, "simulate": rigid, "contact-sim": walk}
        return compare.run(restrict(config, TAKES), inputs, Silent())

    return result


def rows_of(content, where):
    return {row["quantity"]: row for row in content.summary["paper_numbers"] if row["where"] == where}


def test_summary_has_the_documented_keys(compared):
    summary = compared().summary
    assert summary.keys() >= FIXED_KEYS
    assert all(row.keys() >= FIXED_COLUMNS for row in summary["paper_numbers"])
    assert all(
        row.keys() >= {"paper_matlab", "paper_adams", "as_printed", "corrected", "contact"}
        for row in summary["table3"].values()
    )
    assert list(summary["table3"]) == ["t_left", "t_right", "t_cycle", "v_com", "E_avg"]
    verdicts = dict(summary["verdicts"])
    assert verdicts.pop("refuted") == verdicts["contradicted"] + verdicts["not-reproduced"]
    assert list(verdicts) == ["input", "reproduced", "explained", "contradicted", "not-reproduced"]
    assert sum(verdicts.values()) == len(summary["paper_numbers"])
    assert verdicts == {name: sum(row["verdict"] == name for row in summary["paper_numbers"]) for name in verdicts}
    json.dumps(summary, allow_nan=False)


def test_table_3_has_the_values_of_both_models_and_the_paper(compared, study):
    table = compared().summary["table3"]
    assert table["t_left"]["as_printed"] == pytest.approx(study.as_printed.table_3.t_left, rel=1e-9)
    assert table["t_cycle"]["corrected"] == pytest.approx(2 * study.corrected.table_3.t_left, rel=1e-9)
    assert table["t_cycle"]["contact"] == pytest.approx(2 * SLOWER * study.corrected.table_3.t_left, rel=1e-9)
    assert table["v_com"]["contact"] == pytest.approx(study.corrected.table_3.v_com / SLOWER, rel=1e-9)
    assert table["E_avg"]["contact"] == pytest.approx(study.corrected.table_3.E_avg, abs=1e-6)
    assert (table["E_avg"]["paper_matlab"], table["E_avg"]["paper_adams"]) == (150.13, 150.14)


def test_slowed_copy_of_a_walk_differs_in_time_but_not_in_phase(compared):
    summary = compared().summary
    angle, velocity = summary["max_angle_error_rad"], summary["max_velocity_error_rad_s"]
    assert angle["raw"] > 0.05 > 1e-3 > angle["aligned"]
    assert velocity["raw"] > velocity["aligned"]
    assert velocity["settled"] == pytest.approx((1 - 1 / SLOWER) * 1.36, rel=0.1)
    assert 0.0 < summary["orbit_distance"] < 0.02
    assert summary["left_out"] == []


def test_start_off_the_fixed_point_is_listed_as_a_departure_from_the_paper(compared):
    assert compared().summary["departures"] == ["the start is not the rigid model's fixed point"]


def test_stored_differences_equal_those_in_the_summary(compared):
    content = compared()
    aligned, raw = content["aligned"], content["errors"]
    assert aligned["aligned_angle_error_rad"].shape == (10, aligned["phase"].size, 2)
    assert np.abs(aligned["aligned_angle_error_rad"]).max() == content.summary["max_angle_error_rad"]["aligned"]
    assert np.abs(raw["raw_velocity_error_rad_s"]).max() == content.summary["max_velocity_error_rad_s"]["raw"]


def test_x_p_is_reproduced_and_its_misprint_reported(compared):
    rows = rows_of(compared(), "eq. 11, Table 2")
    assert [row["verdict"] for row in rows.values()] == ["reproduced"] * 4
    assert_allclose(
        [row["as_printed"] for row in rows.values()], [-0.202216, 0.167416, -0.600581, -0.846575], atol=1e-6
    )
    assert "cut off" in rows["x_p, dtheta_2"]["evidence"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("walker.hip_mass_kg=12", "hip_mass_kg 12"),
        ("walker.foot_radius_m=0.01", "foot_radius_m 0.01"),
        ("ground.roughness_m=0.001", "the ground is uneven"),
    ],
)
def test_other_walkers_and_uneven_ground_are_not_compared_with_the_paper(compared, change, said):
    content = compared(change)
    assert said in " ".join(content.summary["departures"])
    assert not {"verdicts", "paper_numbers", "table1", "errata"} & content.summary.keys()
    assert set(content.groups) == {"errors", "aligned", "orbit"}
    assert "they apply only to the paper's walker on even ground" in [
        entry["why"] for entry in content.summary["left_out"]
    ]
    assert content.summary["steps"]["gait"]["period_s"] > 0.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("contact.stiffness=2e5", "contact.stiffness (SI) 7.96214e+11 instead of 3.98107e+11"),
        ("contact.terrain=after-mid-swing", "contact.terrain after-mid-swing instead of checkerboard"),
        ("slope_deg=3", "slope_rad 0.0523599 instead of 0.0174"),
    ],
)
def test_departures_from_the_scene_of_the_paper_are_named(compared, change, said):
    assert any(said in departure for departure in compared(change).summary["departures"])


@pytest.mark.parametrize(("steps", "aligned", "orbit"), [(0, False, False), (1, True, False), (3, True, True)])
def test_walk_that_ended_early_is_compared_up_to_its_end(compared, steps, aligned, orbit):
    content = compared(steps=steps, outcome="fell")
    summary = content.summary
    assert summary["max_angle_error_rad"]["raw"] is not None
    assert (summary["max_angle_error_rad"]["aligned"] is not None) == aligned == ("aligned" in content.groups)
    assert (summary["orbit_distance"] is not None) == orbit
    assert (summary["table3"]["t_cycle"]["contact"] is not None) == orbit
    assert orbit or any("stride" in entry["why"] or "step" in entry["why"] for entry in summary["left_out"])
    assert all("None" not in row["evidence"] for row in summary["paper_numbers"])


def test_printed_values_are_compared_even_without_states_and_energies(compared):
    content = compared(leave_out=("angle", "velocity", "mechanical_J"))
    assert content.summary["max_angle_error_rad"]["raw"] is None
    assert content.summary["table3"]["E_avg"]["contact"] is None
    assert content.summary["table3"]["t_left"]["contact"] is not None
    assert {"outputs" in entry["why"] for entry in content.summary["left_out"]} == {True}


def test_walk_that_ended_at_once_has_no_motion_to_compare(compared):
    content = compared(steps=0, outcome="off-pad", samples=1)
    assert content.summary["max_angle_error_rad"]["raw"] is None
    assert any("ended immediately" in entry["why"] for entry in content.summary["left_out"])


def test_equations_without_a_gait_leave_their_column_empty(compared, gaits):
    sets = dict(gaits.summary["equation_sets"], **{"as-printed": {"reason": "too steep"}})
    content = compared(fixedpoint=Content({}, {**gaits.summary, "equation_sets": sets}))
    assert {row["as_printed"] for row in rows_of(content, "Table 3").values()} == {None}
    assert {"what": "columns of the as-printed equations", "why": "too steep"} in content.summary["left_out"]


def test_errata_do_not_depend_on_the_config(compared):
    def told(content):
        return {
            name: content["errata"][name].tolist() for name in ("where", "printed", "right", "evidence", "measured")
        }

    assert told(compared()) == told(compared("slope_deg=3", "contact.stiffness=1e6"))


def test_result_is_bitwise_reproducible_and_complete(compared):
    content = compared(steps=1, outcome="fell")
    assert content.digest() == compared(steps=1, outcome="fell").digest()
    variables = [variable for group in content.groups.values() for variable in group.variables.values()]
    assert not any(variable.missing for variable in variables)


def test_stored_columns_list_only_rows_with_a_value(compared):
    group, rows = compared()["paper_numbers"], compared().summary["paper_numbers"]
    for name in ("as_printed", "corrected", "contact"):
        found = dict(zip(group[f"{name}_row"].tolist(), group[name].tolist(), strict=True))
        assert found == {index: row[name] for index, row in enumerate(rows) if row[name] is not None}
        assert [text == "" for text in group[f"{name}_text"]] == [row[name] is None for row in rows]


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Return the results of the pipeline up to `compare` for the paper's config."""
    loaded = load(None)
    folder = RunFolder(tmp_path_factory.mktemp("runs"), loaded.run_name)
    return execute(loaded.config, "compare", folder)


def test_scene_of_the_paper_config_does_not_differ_from_the_papers_own_scene(stored):
    assert stored.summary["departures"] == []
    assert [entry for entry in stored.left_out if not entry.saves] == []
    assert stored.summary["verdicts"] == {
        "input": 11,
        "reproduced": 5,
        "explained": 2,
        "contradicted": 10,
        "not-reproduced": 10,
        "refuted": 20,
    }


def test_contact_walk_takes_five_cycles_and_lags_the_rigid_one(stored):
    summary = stored.summary
    rows = {(row["where"], row["quantity"]): row for row in summary["paper_numbers"]}
    assert rows["section 5, Fig. 7", "gait cycles walked"]["verdict"] == "input"
    assert rows["Table 2, section 4", "dtheta_2, difference rate"]["contact"] == pytest.approx(0.0, abs=1e-9)
    assert summary["table3"]["t_left"]["contact"] == pytest.approx(0.711, abs=1e-3)
    assert summary["max_angle_error_rad"]["raw"] > 5 * summary["max_angle_error_rad"]["aligned"]
    assert summary["orbit_distance"] < 0.05


@pytest.mark.parametrize(
    "group", ["paper_numbers", "errata", "table1", "table2", "table3", "errors", "aligned", "orbit"]
)
def test_artifact_opens_in_xarray_with_finite_values(stored, group):
    with xarray.open_dataset(stored.artifact, group=group, engine="h5netcdf") as dataset:
        assert dataset.variables
        for variable in dataset.variables.values():
            assert variable.dtype.kind != "f" or np.isfinite(variable).all()
