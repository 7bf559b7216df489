"""Check that results set by hand have the layout of small real runs: groups, variables, keys."""

import re

import pytest
import synthetic_results
import synthetic_tune
import synthetic_walks
from real_results import real
from synthetic_families import families

SYNTHETIC = {
    "walks that the report gets": lambda: {
        name: make() for name, make in synthetic_results.EVERYTHING.items() if name != "compare"
    },
    "walks that figures get": synthetic_walks.both_models,
    "a comparison with the paper": lambda: {"compare": synthetic_results.compare()},
    "families": families,
    "families that move": lambda: {"continuation": synthetic_results.families_that_move(synthetic_results.simulate())},
    "tune": lambda: {"tune": synthetic_tune.tuned()["tune"]},
}
NO_LIMIT = "limit"  # Computing this group takes seconds. Its columns are those that evidence/paper/figures.py requests.


def kinds(groups):
    """Return variables with dimensions and unit. Groups whose names differ only in a number, such as branch_0 and
    branch_1, are merged.
    """
    found = {}
    for path, group in groups.items():
        there = found.setdefault(re.sub(r"\d+", "N", path), {})
        there.update({name: (one.dims, one.units) for name, one in group.variables.items()})
    return found


def keys(summary):
    """Return the keys of a summary. Those inside blocks and rows are dotted."""
    for key, value in summary.items():
        rows = value if isinstance(value, list) else [value]
        inner = {below for row in rows if isinstance(row, dict) for below in keys(row)}
        yield from (key, *(f"{key}.{below}" for below in inner))


@pytest.mark.parametrize("title", SYNTHETIC)
def test_synthetic_results_have_the_layout_of_stored_ones(title):
    for stage, synthetic in SYNTHETIC[title]().items():
        stored = real(stage)
        there = kinds(stored.groups)
        for path, variables in kinds(synthetic.groups).items():
            if path.split("/")[0] == NO_LIMIT:
                continue
            for name, layout in variables.items():
                assert there[path].get(name) == layout, f"{stage} {path} {name}"
        assert set(keys(synthetic.summary)) <= set(keys(stored.summary)), stage
