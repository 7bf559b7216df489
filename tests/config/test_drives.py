"""Tests of the drives in configs, and of the messages with which they are rejected."""

from pathlib import Path

import pytest

from walkerlab.config.drives import Hip, drives_and_springs_of, drives_of, springs_of
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError

PUSH = "push_off.impulse_N_s=0.1"
REFUSED = {
    ("paper-as-printed", PUSH): "equations: .*passive compass, but this walker has a push-off of 0.1 N s",
    ("paper-as-printed", "walker.hip.torque_N_m=1"): "equations: .*this walker has a hip torque of 1 N m",
    ("kneed", PUSH, "walker.knee.at_heel_strike=free"): "push_off: .*needs a locked trailing knee",
    ("simplest", PUSH, "walker.hip_mass_kg=0"): "push_off: .*cannot act on any mass: the hip has none",
    ("simplest", "walker.hip.torque_N_m=0.1"): "walker.hip: .*faster than 10000 rad/s.* limits are 0.0001 \\(torque",
    ("kneed", "walker.hip.spring_N_m_per_rad=-1"): "walker.hip.spring_N_m_per_rad: -1 is out of bounds",
    ("paper", "push_off.duration_s=0"): "push_off.duration_s: 0 is out of bounds",
    ("paper", "walker.hip.spring=1"): "did you mean walker.hip.spring_N_m_per_rad",
}


@pytest.mark.parametrize("asked", REFUSED)
def test_invalid_drives_are_rejected(asked):
    name, *sets = asked
    with pytest.raises(ConfigError, match=REFUSED[asked]):
        load(Path(name), sets)


@pytest.mark.parametrize("name", ["paper", "round-feet", "kneed", "parts"])
def test_walkers_of_every_type_can_be_driven(name):
    sets = (PUSH, "walker.hip.spring_N_m_per_rad=0.01", "walker.hip.damping_N_m_s_per_rad=0.02")
    assert drives_and_springs_of(load(Path(name)).config) == ()
    driven = load(Path(name), sets).config
    assert drives_of(driven) == ("a push-off of 0.1 N s",)
    assert springs_of(driven) == ("a hip spring of 0.01 N m/rad", "a hip damper of 0.02 N m s/rad")


@pytest.mark.parametrize("number", [name for name, field in Hip.model_fields.items() if field.default == 0.0])
def test_every_hip_parameter_has_a_description(number):
    assert len(drives_and_springs_of(load(Path("paper"), (f"walker.hip.{number}=0.01",)).config)) == 1
