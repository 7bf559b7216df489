"""Tests of the stage `basin`: shares of walks, interrupted runs, processes, the contact model, and rejected
requests.
"""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError
from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.basin import ATOL, RTOL
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import basin, fixedpoint
from walkerlab.pipeline.stages.basin import RigidQuestion
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import Checkpoint

GAIT = {
    "state": [-0.2041996085033517, 0.1693996085033517, -0.605819000148935, -0.8610407199844384],
    "step_length_m": 0.3713734,
    "slope_rad": 0.0174,
    "stable": True,
}
SMALL = ("basin.cells=[16,12]", "basin.lower=[0.12,-1.2]", "basin.upper=[0.24,-0.7]", "basin.refine=3")


class CutOff(Silent):
    """A progress display that interrupts the run after some calls of `advance`."""

    def __init__(self, left):
        self.left = left

    def advance(self, n=1):
        if n:
            self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def run(folder, *sets, progress=None, jobs=1, **gait):
    config = restrict(load(None, sets or SMALL).config, PIPELINE["basin"].takes)
    checkpoint = Checkpoint(folder / "basin.parts", "key")
    inputs = {"fixedpoint": Content({}, GAIT | gait)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(basin, "SEARCHED_STARTS", 300)  # Few starts suffice, because there is only one attractor.
        return basin.run(config, inputs, progress or Silent(), checkpoint=checkpoint, jobs=jobs)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def in_bits(monkeypatch):
    """Divide the work into many pieces instead of one."""
    monkeypatch.setattr(RigidQuestion.__init__, "__defaults__", (50, 20, 0, (RTOL, ATOL)))


def test_summary_counts_agree_with_the_grid(whole):
    cells, summary = whole.groups["basin"], whole.summary
    assert summary["plane"] == ["theta_2", "dtheta_2"]
    assert summary["cells"] == [16, 12]
    assert sum(summary["outcomes"].values()) == 16 * 12
    assert summary["outcomes"]["walked"] == np.count_nonzero(cells["outcome"] == Outcome.WALKED)
    assert summary["share_walking"] == pytest.approx(cells["walking"].mean())
    assert summary["attractors"][0]["period"] == 1
    assert summary["attractors"][0]["state"] == pytest.approx(GAIT["state"], abs=1e-6)
    assert summary["held"] == {"dtheta_1": GAIT["state"][2]}
    assert 0.0 < summary["margin"] < 0.1
    again = summary["numerical_error"]
    assert (again["walked_again"], again["of"]) == (100, 16 * 12)
    # For cells at edges, the smallest error decides.
    assert again["ended_otherwise"] <= 5
    ended = {row["outcome"]: row["walks"] for row in summary["endings"]}
    assert ended == {name: many for name, many in summary["outcomes"].items() if name != "walked"}


def test_edge_cells_store_the_share_of_subcells_that_walk(whole):
    cells = whole.groups["basin"]
    walks = cells["outcome"] == Outcome.WALKED
    between = (cells["walking"] > 0.0) & (cells["walking"] < 1.0)
    assert between.any()
    assert np.count_nonzero(between) <= whole.summary["edge_cells"] < walks.size
    assert (cells["walking"][between] * 9).round(9).tolist() == (cells["walking"][between] * 9).round().tolist()


def test_walking_share_of_a_refined_cell_equals_a_finer_grid(tmp_path, whole):
    finer = run(tmp_path, *SMALL[1:3], "basin.cells=[48,36]", "basin.refine=1")
    shares = whole.groups["basin"]["walking"].ravel()
    between = (shares > 0.0) & (shares < 1.0)
    blocks = (finer.groups["basin"]["outcome"] == Outcome.WALKED).reshape(16, 3, 12, 3).mean(axis=(1, 3)).ravel()
    np.testing.assert_allclose(shares[between], blocks[between], atol=1e-12)


def test_normal_weights_are_largest_at_the_gait_and_sum_to_one(whole):
    window = basin.window_of(load(None, SMALL).config, GAIT["state"][1:])
    weights = basin.gaussian(window)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[8, 6] == weights.max()
    assert whole.summary["share_walking_gaussian"] == pytest.approx((weights * whole.groups["basin"]["walking"]).sum())


@pytest.mark.usefixtures("in_bits")
def test_interrupted_run_resumes_with_the_same_result(tmp_path, whole):
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, progress=CutOff(3))
    kept = (tmp_path / "basin.parts").read_bytes().count(b"\n")
    assert kept > 2
    again = run(tmp_path)
    assert (tmp_path / "basin.parts").read_bytes().count(b"\n") > kept
    assert again.digest() == whole.digest()


@pytest.mark.usefixtures("in_bits")
def test_one_and_two_processes_give_the_same_result(tmp_path, whole):
    assert run(tmp_path, jobs=2).digest() == whole.digest()


def test_grid_over_all_three_coordinates_fixes_none(tmp_path):
    found = run(
        tmp_path,
        "basin.plane=[theta_2,dtheta_1,dtheta_2]",
        "basin.cells=[4,3,5]",
        "basin.lower=[0.15,-0.7,-0.95]",
        "basin.upper=[0.19,-0.5,-0.8]",
        "basin.refine=1",
    )
    assert found.groups["basin"]["outcome"].shape == (4, 3, 5)
    assert found.summary["held"] == {}
    assert found.summary["outcomes"]["walked"] > 0


def test_contact_walks_settle_on_the_contact_gait(tmp_path):
    found = run(
        tmp_path,
        "basin.model=contact",
        "basin.cells=[2,2]",
        "basin.lower=[0.165,-0.9]",
        "basin.upper=[0.175,-0.4]",
        "basin.refine=1",
    )
    cells = found.groups["basin"]
    assert found.summary["attractors"][0]["period_s"] == pytest.approx(0.711, abs=1e-3)
    assert Outcome.WALKED not in cells["outcome"][:, 1]
    settled = cells["attractor"] == 0
    assert (cells["outcome"][settled] == Outcome.WALKED).all()


def test_contact_model_needs_a_contact_block(tmp_path):
    with pytest.raises(ConfigError, match="contact block"):
        run(tmp_path, "contact=null", "basin.model=contact")


def test_walkers_with_more_than_three_coordinates_are_rejected(tmp_path):
    free = load(Path("kneed"), ["walker.knee.at_heel_strike=free"]).config
    inputs = {"fixedpoint": Content({}, GAIT)}
    with pytest.raises(ConfigError, match="3 coordinates just after heel strike; this one has 4"):
        basin.run(
            restrict(free, PIPELINE["basin"].takes), inputs, Silent(), checkpoint=Checkpoint(tmp_path / "parts", "key")
        )


def test_reversed_window_bounds_are_rejected(tmp_path):
    with pytest.raises(ConfigError, match="is not below"):
        run(tmp_path, "basin.lower=[0.9,-1.0]")


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("basin.plane=[theta_2]", "two or three"),
        ("basin.plane=[theta_2,theta_2]", "each once"),
        ("basin.cells=[10,10,10]", "2 numbers"),
        ("basin.cells=[10,1]", "2"),
        ("basin.model=both", "rigid"),
    ],
)
def test_invalid_basin_block_is_rejected(setting, said):
    with pytest.raises(ConfigError, match=said):
        load(None, [setting])


def test_basin_is_never_required_but_is_drawn_if_current():
    assert PIPELINE["basin"].only_by == "basin"
    assert all("basin" not in stage.inputs(load(None, ()).config) for stage in PIPELINE.stages)
    assert "basin" in PIPELINE["plot"].if_current
    assert "basin" in PIPELINE["report"].if_current


NEARLY_EQUAL = "walker.leg_2={leg_mass_kg: 5.000001}"


def test_basin_of_nearly_equal_legs_equals_that_of_equal_legs(whole, tmp_path):
    content = run(tmp_path, *SMALL, NEARLY_EQUAL)
    (row,), (equal,) = content.summary["attractors"], whole.summary["attractors"]
    assert (row["period"], equal["period"]) == (2, 1)
    np.testing.assert_allclose(row["state"], equal["state"], atol=1e-6)
    assert row["cells"] == equal["cells"]
    assert content.summary["outcomes"] == whole.summary["outcomes"]
    assert content.summary["numerical_error"]["ended_otherwise"] == 0
    # The search for a settled walk checks once per stride.
    steps, steps_of_equal = (each.groups["basin"]["steps_to_settle"] for each in (content, whole))
    assert np.isin(steps - steps_of_equal, [0, 1]).all()


def test_starts_of_a_limping_walker_reach_the_gait_that_fixedpoint_finds(tmp_path):
    config = load(Path("prosthesis"), ()).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent()).summary
    asked = restrict(load(Path("prosthesis"), ("basin.cells=[8,8]", "basin.refine=1")).config, PIPELINE["basin"].takes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(basin, "SEARCHED_STARTS", 100)
        content = basin.run(
            asked, {"fixedpoint": Content({}, gait)}, Silent(), checkpoint=Checkpoint(tmp_path / "parts", "key"), jobs=1
        )
    (row,) = content.summary["attractors"]
    assert row["period"] == 2
    assert row["cells"] > 0
    np.testing.assert_allclose(row["state"], gait["state"], atol=1e-9)
