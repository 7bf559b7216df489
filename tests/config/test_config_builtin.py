"""The configs that come with the package, and the text of a resolved config."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from walkerlab.config.files import BUILTIN_FOLDER, builtin_names
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.schema import METHODS, OUTPUTS, Config
from walkerlab.config.writer import to_yaml

REPOSITORY = Path(__file__).parents[2] / "configs"


def test_built_in_configs_are_listed() -> None:
    others = ("kneed", "kneed-round-feet", "parts", "round-feet", "simplest", "torso")
    papers = ("contact-si", "paper", "paper-as-printed", "rigid-only", "sliding-feet", "slope-3deg")
    driven = ("kneed-level", "kuo", "level")
    different_legs = ("one-knee", "prosthesis")
    assert builtin_names() == tuple(sorted((*others, *papers, *driven, *different_legs)))


@pytest.mark.skipif(not REPOSITORY.is_dir(), reason="the repository's configs/ are not beside the tests")
def test_built_in_configs_equal_those_of_the_repository() -> None:
    """In a checkout they are the same files. An installed package has copies."""
    here, installed = (
        {path.relative_to(folder): path.read_text(encoding="utf-8") for path in folder.rglob("*.yaml")}
        for folder in (REPOSITORY, BUILTIN_FOLDER)
    )
    assert here == installed
    assert len(here) > 30


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_config_runs_under_its_own_name(name: str) -> None:
    loaded = load(Path(name))
    assert (loaded.run_name, loaded.warnings) == (name, ())


def test_config_as_printed_differs_from_paper_only_in_its_equations() -> None:
    printed, paper = load(Path("paper-as-printed")).config, load().config
    assert printed == paper.model_copy(update={"name": "paper-as-printed", "equations": "as-printed"})


def test_config_contact_si_reads_the_contact_values_of_the_paper_as_si() -> None:
    contact = load(Path("contact-si")).config.contact
    assert contact is not None
    law = contact.to_si()
    assert (law.stiffness, law.exponent, law.damping) == (1e5, 1.0, 90.0)
    assert (law.full_damping_penetration, law.static_friction, law.dynamic_friction) == (1e-4, 0.9, 0.7)
    assert (law.stiction_velocity, law.friction_velocity) == (0.1, 1.0)


@pytest.mark.parametrize("name", builtin_names())
def test_resolved_config_loads_back_unchanged(name: str, loaded: Callable[..., LoadedConfig]) -> None:
    config = load(Path(name)).config
    assert loaded(to_yaml(config)).config == config


number = st.floats(1e-3, 0.45)
INSTALLED = [method for method in METHODS if not method.startswith("cvode")]


@st.composite
def configs(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "name": draw(st.sampled_from(["1e5", "null", "no", "007", "a.b-c_", "x" * 64])),
        "walker": {"leg_mass_kg": draw(st.floats(1e-6, 1e6)), "foot_to_mass_m": draw(number)},
        "slope_rad": draw(st.floats(-1.5, 1.5)),
        "strides": draw(st.integers(1, 10_000)),
        "contact": draw(st.none() | st.fixed_dictionaries({"pad_pitch": number | st.sampled_from(["rigid", "own"])})),
        "solver": {"rigid": {"method": draw(st.sampled_from(INSTALLED)), "rtol": draw(st.floats(1e-14, 0.1))}},
        "outputs": draw(st.lists(st.sampled_from(OUTPUTS))),
    }


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(configs())
def test_any_config_survives_a_round_trip_through_text(
    loaded: Callable[..., LoadedConfig], data: dict[str, Any]
) -> None:
    config = Config.model_validate(data)
    assert loaded(to_yaml(config)).config == config
