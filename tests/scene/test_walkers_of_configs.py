"""Tests of walkers built from configs: types, limits, parts, and rejected descriptions."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.contact import contact_scene
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker, state_names
from walkerlab.scene.studies import equation_sets
from walkerlab.scene.subject import iterate_values

DOCS = Path(__file__).parents[2] / "docs" / "walkers.md"


def numbers_of(model: RigidModel):
    names = [name for name in model.dtype.names if name not in ("roles", "section")]
    return np.concatenate([np.ravel(model[name]) for name in names])


def test_kneed_walker_equals_its_description_by_parts(tmp_path):
    (text,) = re.findall(r"```yaml\n(# own-parts.yaml\n.*?)```", DOCS.read_text(), re.DOTALL)
    path = tmp_path / "own-parts.yaml"
    path.write_text(text)
    own, kneed = load(path).config, load(Path("kneed")).config
    assert own.walker == load(Path("parts")).config.walker
    assert state_names(own) == state_names(kneed)
    one, other = rigid_walker(own, "corrected"), rigid_walker(kneed, "corrected")
    assert one.dtype == other.dtype
    assert numbers_of(one) == pytest.approx(numbers_of(other), rel=1e-15)
    assert (one.section_indices, one.roles.tolist()) == (other.section_indices, other.roles.tolist())


def kneed_with_feet_ahead(radius_m):
    """Return a config of a kneed walker whose feet are 3 cm ahead of its shanks, on a slope of 2.5 degrees."""
    return load(
        Path("kneed"),
        [
            "slope_deg=2.5",
            "walker.thigh={length_m: 0.46, mass_kg: 2.345, mass_below_hip_m: 0.2, inertia_kg_m2: 0.02}",
            "walker.shank={length_m: 0.54, mass_kg: 1.013, mass_below_knee_m: 0.24, inertia_kg_m2: 0.02}",
            f"walker.foot_radius_m={radius_m}",
            "walker.foot_centre_ahead_m=0.03",
            "walker.hip_mass_kg=10",
        ],
    ).config


def by_its_parts(radius_m):
    """Return the same walker, built from its parts."""
    limbs = {
        "thigh": "mass_kg: 2.345, centre_m: [0.0, -0.2], inertia_kg_m2: 0.02",
        "shank": "mass_kg: 1.013, centre_m: [0.0, -0.24], inertia_kg_m2: 0.02",
    }
    bodies = [f"{{name: {limb} {k}, {measures}}}" for limb, measures in limbs.items() for k in (1, 2)]
    foot = f"centre_m: [0.03, {radius_m - 0.54!r}], radius_m: {radius_m}"
    walker = {
        "leg_length_m": "1.0",
        "bodies": f"[{', '.join(bodies)}]",
        "particles": "[{name: hip, mass_kg: 10, body: thigh 2, at_m: [0.0, 0.0]}]",
        "feet": f"[{{body: shank 1, {foot}}}, {{body: shank 2, {foot}}}]",
    }
    walker["hinges"] = (
        "[{name: hip, parent: thigh 2, parent_point_m: [0.0, 0.0], child: thigh 1, child_point_m: [0.0, 0.0]}"
        + "".join(
            f", {{name: knee {k}, parent: thigh {k}, parent_point_m: [0.0, -0.46], child: shank {k}, "
            "child_point_m: [0.0, 0.0], locks: true}"
            for k in (1, 2)
        )
        + "]"
    )
    return load(Path("parts"), ["slope_deg=2.5", *(f"walker.{key}={value}" for key, value in walker.items())]).config


@pytest.mark.parametrize("radius_m", [0.0, 0.2])
def test_kneed_walker_with_feet_ahead_equals_the_same_walker_described_part_by_part(radius_m):
    own, parts = kneed_with_feet_ahead(radius_m), by_its_parts(radius_m)
    one, other = rigid_walker(own), rigid_walker(parts)
    assert one.lean == pytest.approx(math.atan2(0.03, 1.0 - radius_m), rel=1e-15)
    assert own.walker.lean_rad == one.lean
    assert numbers_of(one) == pytest.approx(numbers_of(other), rel=1e-14, abs=1e-16)
    on_ground = [contact_scene(config, 0.67, 0.67).walker for config in (own, parts)]
    for number, same in zip(*map(iterate_values, on_ground), strict=True):
        if getattr(number, "dtype", np.dtype("O")).names:
            number, same = numbers_of(number), numbers_of(same)
        if isinstance(number, (float, np.ndarray)):
            np.testing.assert_allclose(number, same, rtol=1e-14, atol=1e-16)


def test_gait_of_a_kneed_walker_with_feet_ahead_agrees_with_independent_code():
    """The expected values come from an independent program for the walker built from its parts."""
    gait = find_gaits(rigid_walker(kneed_with_feet_ahead(0.2))).gait
    assert gait.period == pytest.approx(0.8295992430, abs=1e-9)
    assert gait.step_length == pytest.approx(0.6736206197, abs=1e-9)
    assert gait.spectral_radius == pytest.approx(0.3333740739, abs=1e-8)


def test_both_feet_touch_the_slope_at_the_start_if_foot_centres_lie_ahead():
    start = "start=[null, 0.26, null, -0.49, -1.157, -0.49]"
    config = kneed_with_feet_ahead(0.2)
    moved = load(Path("kneed"), ["slope_deg=2.5", "walker.foot_radius_m=0.2", "walker.foot_centre_ahead_m=0.03", start])
    swing, stance, shank, *_ = moved.config.start
    # Both feet touch the slope if their centres are equally far below the hip along the slope's normal.
    depth = [math.cos(angle + config.slope_rad + config.walker.lean_rad) for angle in (swing, stance)]
    assert depth[0] == pytest.approx(depth[1], rel=1e-14)
    assert shank == swing


@pytest.mark.parametrize(
    ("name", "mass", "numbers"),
    [("simplest", 1.0, 4), ("round-feet", 2.0, 4), ("kneed", 1.6, 6), ("kneed-round-feet", 1.6, 6), ("torso", 20.0, 6)],
)
def test_built_in_walkers_have_the_expected_mass_and_state_size(name, mass, numbers):
    config = load(Path(name)).config
    model = rigid_walker(config, "corrected")
    assert model.mass == pytest.approx(mass, rel=1e-11)
    assert config.walker.total_mass_kg == pytest.approx(mass, rel=1e-11)
    assert len(state_names(config)) == len(model.zero_state) == numbers
    assert len(assembly_of(config.walker).feet) == 2


def test_appendix_a_applies_to_a_plain_compass_only():
    assert equation_sets(load().config) == ("corrected", "as-printed")
    assert equation_sets(load(Path("torso")).config) == ("corrected",)


def test_only_the_paper_walker_also_gets_the_printed_equations():
    assert equation_sets(load(None, ("slope_deg=3",)).config) == ("corrected", "as-printed")
    assert equation_sets(load(None, ("walker.hip_mass_kg=12",)).config) == ("corrected",)
    assert equation_sets(load(None, ("walker.hip_mass_kg=12", "equations=as-printed")).config) == ("as-printed",)


@pytest.mark.parametrize(
    ("config", "setting", "said"),
    [
        ("kneed", "walker.shank.mass_below_knee_m=0", "massless"),
        ("round-feet", "walker.foot_radius_m=0.5", "below leg_length_m"),
        ("simplest", "contact={}", "next to no mass"),
        ("torso", "equations=as-printed", "compass"),
        ("kneed", "walker.type=knead", "kneed"),
        ("kneed", "walker.thigh.mas_kg=1", "mass_kg"),
        ("kneed", "start=[0.1, 0.1, 0.1, 0.1]", "6"),
    ],
)
def test_impossible_walkers_are_rejected_with_the_reason(config, setting, said):
    with pytest.raises(ConfigError) as refused:
        load(Path(config), [setting])
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("locks: true}\n  particles", "locks: false}\n  particles", "no locking knee"),
        ("[thigh 2, shank 2]]", "[thigh 2, thigh 1]]", "does not belong to leg 2"),
        ("child: shank 2, child_point_m: [0.0, 0.0], locks: true", "child: thigh 1, child_point_m: [0.0, 0.0]", "loop"),
    ],
)  # fmt: skip
def test_parts_that_form_no_walker_are_rejected(tmp_path, old, new, said):
    (text,) = re.findall(r"```yaml\n(# own-parts.yaml\n.*?)```", DOCS.read_text(), re.DOTALL)
    assert old in text
    path = tmp_path / "broken.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        rigid_walker(load(path).config, "corrected")
    assert said in str(refused.value)
