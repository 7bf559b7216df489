"""Walkers described in YAML: types, limits, own parts, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.mechanics.standing import Standing
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import coordinates, equation_sets, rigid_walker

DOCS = Path(__file__).parents[2] / "docs" / "walkers.md"


def numbers_of(model: Standing):
    names = [name for name in model.dtype.names if name not in ("roles", "section")]
    return np.concatenate([np.ravel(model[name]) for name in names])


def test_the_kneed_walker_described_by_its_parts_is_the_kneed_walker(tmp_path):
    (text,) = re.findall(r"```yaml\n(name: own-parts.*?)```", DOCS.read_text(), re.DOTALL)
    path = tmp_path / "own-parts.yaml"
    path.write_text(text)
    own, kneed = load(path).config, load(Path("kneed")).config
    assert own.walker == load(Path("parts")).config.walker
    assert coordinates(own) == coordinates(kneed)
    one, other = rigid_walker(own, "corrected"), rigid_walker(kneed, "corrected")
    assert one.dtype == other.dtype
    assert numbers_of(one) == pytest.approx(numbers_of(other), rel=1e-15)
    assert (one.section_indices, one.roles.tolist()) == (other.section_indices, other.roles.tolist())


@pytest.mark.parametrize(
    ("name", "mass", "numbers"),
    [("simplest", 1.0, 4), ("round-feet", 2.0, 4), ("kneed", 1.6, 6), ("kneed-round-feet", 1.6, 6), ("torso", 20.0, 6)],
)
def test_a_built_in_walker_has_its_mass_and_its_state(name, mass, numbers):
    config = load(Path(name)).config
    model = rigid_walker(config, "corrected")
    assert model.mass == pytest.approx(mass, rel=1e-11)
    assert config.walker.total_mass_kg == pytest.approx(mass, rel=1e-11)
    assert len(coordinates(config)) == len(model.zero_state) == numbers
    assert len(assembly_of(config.walker).feet) == 2


def test_appendix_a_is_a_plain_compass_only():
    assert equation_sets(load().config) == ("corrected", "as-printed")
    assert equation_sets(load(Path("torso")).config) == ("corrected",)


def test_equations_as_printed_are_beside_the_corrected_ones_for_the_papers_walker_only():
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
def test_what_cannot_be_meant_is_refused_with_the_reason(config, setting, said):
    with pytest.raises(ConfigError) as refused:
        load(Path(config), [setting])
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{name: shank 2, mass_kg: 0.05", "{name: shank 2, mass_kg: 0.06", "differ"),
        ("locks: true}\n  particles", "locks: false}\n  particles", "without a knee"),
        ("[thigh 2, shank 2]]", "[thigh 2, thigh 1]]", "is not of leg 2"),
        ("child: shank 2, child_point_m: [0.0, 0.0], locks: true", "child: thigh 1, child_point_m: [0.0, 0.0]", "loop"),
    ],
)  # fmt: skip
def test_parts_that_make_no_walker_are_refused_in_words(tmp_path, old, new, said):
    (text,) = re.findall(r"```yaml\n(name: own-parts.*?)```", DOCS.read_text(), re.DOTALL)
    assert old in text
    path = tmp_path / "broken.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        rigid_walker(load(path).config, "corrected")
    assert said in str(refused.value)
