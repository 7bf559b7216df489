"""Tests of the maps: cells agree with the walks, an interrupted run continues, and figures are drawn."""

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.evidence.verification import stability_maps
from walkerlab.evidence.verification.stability_maps import (
    ERROR_MISSING,
    PAPER_STIFFNESS,
    VERDICT_NAMES,
    prepare_on_ground,
    step_column,
    stiction_cell,
    units_of,
)
from walkerlab.outcome import Outcome
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.files import Checkpoint

CELLS = 2


class CutOff(Silent):
    """A progress display that interrupts the run after some calls of `advance`."""

    def __init__(self, left):
        self.left, self.done, self.total = left, 0, 0

    def start(self, label, total=None):
        self.total = total

    def advance(self, n=1):
        self.done += n
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def run(folder, progress=None, jobs=1):
    config = restrict(load(None, [f"stability.map_cells={CELLS}"]).config, PIPELINE["stability-maps"].takes)
    checkpoint = Checkpoint(folder / "maps.parts", "key")
    return stability_maps.run(config, {}, progress or Silent(), checkpoint=checkpoint, jobs=jobs)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run(tmp_path_factory.mktemp("whole"))


def test_walk_in_the_map_cell_with_the_ground_of_the_paper_completes_its_steps():
    outcome, steps, sharper, error, _ = stiction_cell(PAPER_STIFFNESS, 0.1)
    assert (outcome, steps, sharper) == (Outcome.WALKED, 4, Outcome.WALKED)
    assert 0.0 < error < 1e-6


def test_ground_of_the_paper_is_a_cell_of_the_map():
    contact = prepare_on_ground(PAPER_STIFFNESS, 0.1, 4, 1000)[1].contact.to_si()
    assert vars(contact) == pytest.approx(vars(load().config.contact.to_si()))


def test_small_fixed_step_is_accurate_and_its_error_falls_with_its_size():
    numbers = step_column(PAPER_STIFFNESS, (4e-6, 8e-6, 1e-3))
    verdicts = [VERDICT_NAMES[int(number)] for number in numbers[::2]]
    assert verdicts == ["fine", "fine", "diverges"]
    assert 0.0 < numbers[1] < 0.7 * numbers[3]  # A method of first order or better at half the step.
    assert numbers[5] == ERROR_MISSING


def test_error_is_missing_for_cells_whose_runs_end_differently():
    """This includes runs that end in the same way after different numbers of steps."""
    walked, slid = float(Outcome.WALKED), float(Outcome.SLID)
    rows = (
        [walked, 4.0, walked, 1e-7, 9.0],
        [slid, 1.0, slid, ERROR_MISSING, 9.0],
        [walked, 4.0, slid, ERROR_MISSING, 9.0],
    )
    cells = (rows[0], rows[1], rows[2], rows[1])
    kept = {f"stiction {i} {j}": list(cells[2 * i + j]) for i in range(2) for j in range(2)}
    found = stability_maps.stiction_group(2, kept)
    np.testing.assert_array_equal(found["error"], [[1e-7, np.nan], [np.nan, np.nan]])
    assert found["compared"].tolist() == [[1, 0], [0, 0]]
    fine, diverges = float(VERDICT_NAMES.index("fine")), float(VERDICT_NAMES.index("diverges"))
    step = stability_maps.step_group(2, {f"step {i}": [fine, 1e-5, diverges, ERROR_MISSING] for i in range(2)})
    np.testing.assert_array_equal(step["error"], [[1e-5, 1e-5], [np.nan, np.nan]])
    kept = {name: list(rows[1]) for name in kept}
    none = stability_maps.summary_of(stability_maps.stiction_group(2, kept), step)
    assert (none["largest_error"], none["median_error"]) == (None, None)


def test_every_cell_has_a_unique_name():
    units = list(units_of(3))
    assert len({name for name, *_ in units}) == len(units)
    assert sum(cells for _, cells, _ in units) == 2 * 3 * 3


def test_both_maps_are_stored(whole):
    stiction, step = whole.groups["stiction"], whole.groups["step"]
    assert stiction["outcome"].shape == step["verdict"].shape == (CELLS, CELLS)
    np.testing.assert_array_equal(step["step_size"], np.geomspace(1e-6, 1e-2, CELLS))
    assert stiction["outcome"][1, 0] == Outcome.SLID  # Friction as on oil.
    assert step["verdict"][1].tolist() == [VERDICT_NAMES.index("diverges")] * 2
    assert whole.summary["cells"] == 8
    assert sum(whole.summary["outcomes"].values()) == sum(whole.summary["fixed_step"].values()) == 4


@pytest.mark.parametrize("stiffer", [1.0, 1e2, 1e4])
def test_walker_slides_on_oil_at_any_stiffness(stiffer):
    assert stiction_cell(stiffer * PAPER_STIFFNESS, 10.0)[::2][:2] == [Outcome.SLID] * 2


def test_interrupted_run_resumes_with_the_same_result(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, CutOff(left=1 + 3))  # the piece that existed already, and three new ones
    kept = Checkpoint(tmp_path / "maps.parts", "key").kept
    assert sorted(kept) == ["step 0", "step 1", "stiction 0 0"]
    rest = CutOff(left=99)
    assert run(tmp_path, rest).digest() == whole.digest()
    assert rest.left == 99 - (1 + 3)
    assert rest.done == rest.total == 8


def test_two_processes_give_the_same_result(whole, tmp_path):
    assert run(tmp_path, jobs=2).digest() == whole.digest()
