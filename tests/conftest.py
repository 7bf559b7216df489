"""What all tests share: property tests draw the same examples everywhere, and a slow machine is no failure.

Files that compile or compute longest come first: no worker is left alone with one of them while the others are done.
"""

from hypothesis import settings

settings.register_profile("walkerlab", deadline=None, derandomize=True, database=None)
settings.load_profile("walkerlab")

LONGEST_FIRST = (
    "test_campaigns", "test_tune", "test_same_bits", "test_kneed_contact_walk", "test_whole_report", "test_plain_walks",
    "test_scene_catalogue", "test_rigid_walk", "test_catalogue", "test_continuation", "test_api", "test_sweep_engines",
    "test_hinged_walks", "test_lean_scenes", "test_exports", "test_engine_adapters", "test_page", "test_server",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    """Sort the files; tests of one file stay in their order."""
    places = {name: place for place, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(places)))
