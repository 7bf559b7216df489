"""Check that the docstring of the hybrid package names all events and files."""

import re
from pathlib import Path

from walkerlab.physics import hybrid
from walkerlab.physics.hybrid import contact_state, rigid_walk

NO_EVENTS = {
    "MATERIAL", "PER_FOOT", "EVENT_FUNCTIONS", "NO_EVENT", "LEGS_TURN", "EVENT_ROWS", "FARTHEST_SLIDE",
    "NOT_DUE", "AT_PULSE_END", "STRAIGHT_KNEE", "ON_GROUND", "MIN_FLEXION", "AT_COMPRESSION", "START_ROUNDING",
    "STEP_FIELDS",
}  # fmt: skip


def test_hybrid_module_docstring_lists_every_event():
    of_contact = {name for name in vars(contact_state) if name.isupper()} - NO_EVENTS
    rigid = ("HEEL_STRIKE", "HIP_FALL", "AHEAD", "KNEE")
    assert [getattr(rigid_walk, name) for name in rigid] == list(range(rigid_walk.LEG_RATE))
    assert of_contact | set(rigid) <= set(re.findall(r"[A-Z_]+", hybrid.__doc__))


def test_hybrid_module_docstring_lists_every_file():
    files = {path.stem for path in Path(hybrid.__file__).parent.glob("*.py")} - {"__init__"}
    assert files <= set(re.findall(r"`(\w+)`", hybrid.__doc__))


def test_event_numbers_of_a_contact_walk_are_unique():
    of_foot = ("HEIGHT", "LEFT_EDGE", "RIGHT_EDGE", "RELEASE", "FULL_DAMPING", "MATERIAL", "VERTICAL_VELOCITY")
    each = [getattr(contact_state, name) for name in of_foot]
    each += range(contact_state.FRICTION_SWITCHES, contact_state.FRICTION_SWITCHES + 4)
    assert sorted(each) == list(range(contact_state.PER_FOOT))
    of_walker = [getattr(contact_state, name) for name in ("PASSING", "FALL", "SLIDE")]
    of_knees = [first + knee for first in (contact_state.EXTENSION, contact_state.EXTENSION_RATE) for knee in range(2)]
    others = [*of_walker, *of_knees, contact_state.PULSE_END]
    assert sorted(others) == list(range(2 * contact_state.PER_FOOT, contact_state.PULSE_END + 1))
