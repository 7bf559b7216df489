"""Settings of all tests. Property tests draw the same examples everywhere, and may take long on slow machines.

Files that compile or compute longest come first, so that no worker is still busy with one of them when the others are
done. There is one more worker than processors, because workers often wait for programs, browsers and servers.
"""

import os

import pytest
from hypothesis import settings

from walkerlab.pipeline.run.workers import ONE_THREAD

# The command line does the same. It must come before NumPy is imported: the last digits of library methods depend on
# it.
for name in ONE_THREAD:
    os.environ.setdefault(name, "1")

settings.register_profile("walkerlab", deadline=None, derandomize=True, database=None)
settings.load_profile("walkerlab")

# Of the first three, one compiles the kernels of the package, one those of the tests, and one draws figures.
LONGEST_FIRST = (
    "test_campaigns", "test_plain_walks", "test_figure_style", "test_tune", "test_same_bits", "test_kneed_contact_walk",
    "test_whole_report", "test_docs", "test_scene_catalogue", "test_rigid_walk", "test_catalogue", "test_continuation",
    "test_api", "test_sweep_engines", "test_pinned_walks", "test_lean_scenes", "test_exports", "test_engine_adapters",
    "test_page", "test_server", "test_every_key", "test_figures", "test_robustness_stage", "test_robustness",
    "test_fresh_code", "test_sources",
)  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_xdist_auto_num_workers():
    """Return the number of workers, which `--maxprocesses` may reduce."""
    return (yield) + 1


def pytest_collection_modifyitems(items):
    """Sort the files, and keep the order of the tests in each file."""
    places = {name: place for place, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(places)))
