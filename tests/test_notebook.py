"""Check that the notebook of the tutorial runs from top to bottom and gives the results that its text states."""

import json
from pathlib import Path

import matplotlib
import pytest

NOTEBOOK = Path(__file__).parent.parent / "docs" / "notebook.ipynb"


@pytest.fixture(scope="module")
def names():
    """Run the notebook and return the names that its cells define."""
    matplotlib.use("Agg")
    names = {}
    for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    yield names
    names["plt"].close("all")


def test_steps_take_longer_on_soft_ground(names):
    periods = [names[walk].summary["step_periods_s"][-1] for walk in ("rigid", "soft")]
    assert names["gait"].summary["stable"]
    assert periods[0] < periods[1] < 1.05 * periods[0]


def test_gait_loses_stability_between_four_and_five_degrees(names):
    assert [names["gaits"][slope]["stable"] for slope in names["slopes"]] == [True, True, True, True, False]


def test_notebook_explains_the_missing_gait_on_a_steep_slope(names):
    assert "no gait" in names["steep"].no_answer


def test_stored_notebook_was_run_from_top_to_bottom():
    cells = [cell for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
