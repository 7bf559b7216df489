"""Check what the schema accepts and rejects, on both sides of every bound."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from walkerlab.config import schema
from walkerlab.config.fields import Block, annotation_of, leaves
from walkerlab.config.loader import load
from walkerlab.config.schema import METHODS, Config, Contact, SolverSettings
from walkerlab.config.walkers import CompassWalker, Kneed, Shank
from walkerlab.errors import ConfigError


def admits(block: type[Block], **values: Any) -> bool:
    try:
        block(**values)
    except ValidationError:
        return False
    return True


def test_defaults_are_the_values_of_the_paper() -> None:
    config = Config()
    walker = config.walker
    assert (walker.leg_length_m, walker.leg_mass_kg, walker.hip_mass_kg) == (1.0, 5.0, 10.0)
    assert (walker.foot_to_mass_m, walker.mass_to_hip_m, walker.total_mass_kg) == (0.5, 0.5, 20.0)
    assert (config.gravity_m_s2, config.slope_rad, config.strides, config.seed) == (9.81, 0.0174, 5, 0)
    assert (config.equations, config.start, config.contact) == ("corrected", "fixed-point", None)
    assert config.outputs == ("states", "energies", "forces")


def test_partial_solver_block_keeps_the_defaults_of_each_model() -> None:
    solver = Config.model_validate({"solver": {"rigid": {"rtol": 1e-6}, "contact": {"atol": 1e-6}}}).solver
    assert (solver.rigid.method, solver.rigid.rtol, solver.rigid.atol) == ("dop853", 1e-6, 1e-12)
    assert (solver.contact.method, solver.contact.rtol, solver.contact.atol) == ("radau5", 1e-7, 1e-6)
    assert isinstance(solver.contact, SolverSettings)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_allowed_for_both_models(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # The result must not depend on which packages are installed.
    monkeypatch.setattr(schema, "find_spec", lambda name: name)
    solver = {"rigid": {"method": method}, "contact": {"method": method}}
    assert Config.model_validate({"solver": solver}).solver.rigid.method == method


def test_config_is_immutable_and_hashable() -> None:
    config = Config(contact=Contact())
    with pytest.raises(ValidationError):
        config.strides = 6  # type: ignore[misc]
    assert {config: 1}[Config(contact=Contact())] == 1


@pytest.mark.parametrize("field", [pytest.param(field, id=".".join(path)) for path, field in leaves(Config)])
def test_every_key_has_a_meaning_a_source_and_a_unit_if_it_is_a_number(field: Any) -> None:
    assert field.description
    assert annotation_of(field, "source")
    if field.annotation in (float, int):
        assert annotation_of(field, "unit")


@pytest.mark.parametrize(
    ("block", "values"),
    [
        (CompassWalker, {"leg_length_m": 1e-3, "foot_radius_m": 1e-6}),
        (CompassWalker, {"leg_length_m": 1e3}),
        (CompassWalker, {"foot_to_mass_m": 0.01}),
        (CompassWalker, {"foot_to_mass_m": 0.99}),
        (CompassWalker, {"hip_mass_kg": 0.0}),
        (CompassWalker, {"hip_mass_kg": 1e6}),
        (CompassWalker, {"leg_mass_kg": 1e-6}),
        (CompassWalker, {"leg_mass_kg": 1e3}),
        (CompassWalker, {"leg_inertia_kg_m2": 0.4}),
        (CompassWalker, {"leg_length_m": 1e-3}),
        (Kneed, {"shank": Shank(length_m=0.553), "foot_radius_m": 0.56}),
        (CompassWalker, {"foot_radius_m": 0.0}),
        (CompassWalker, {"foot_radius_m": 0.4999}),
        (Config, {"gravity_m_s2": 1.62}),
        (Config, {"gravity_m_s2": 24.8}),
        (Config, {"slope_rad": math.radians(-1.0)}),
        (Config, {"slope_rad": 0.0}),
        (Config, {"slope_rad": math.radians(45.0)}),
        (Config, {"slope_rad": math.radians(89.999)}),
        (Config, {"start": [-0.2, 0.17, 1e3, -1e3]}),
        (Config, {"outputs": []}),
        (Config, {"strides": 1}),
        (Contact, {"units": "si", "stiffness": 1e14}),
        (Contact, {"units": "si", "damping": 1e8}),
        (Contact, {"damping": 0}),
        (Contact, {"exponent": 1}),
        (Contact, {"exponent": 3}),
        (Contact, {"static_friction": 100, "dynamic_friction": 100}),
        (Contact, {"static_friction": 0, "dynamic_friction": 0}),
        (Contact, {"units": "si", "stiction_velocity": 1e-7}),
        (Contact, {"units": "si", "stiction_velocity": 10, "friction_velocity": 100}),
        (Contact, {"stiction_velocity": 1e-4}),
        (Contact, {"pad_pitch": 0.36}),
        (Contact, {"pad_pitch": "own"}),
        (SolverSettings, {"rtol": 1e-14, "atol": 1e-300}),
        (SolverSettings, {"rtol": 0.1}),
    ],
)
def test_values_at_the_bounds_are_accepted(block: type[Block], values: dict[str, Any]) -> None:
    assert admits(block, **values)


@pytest.mark.parametrize(
    ("block", "values"),
    [
        (CompassWalker, {"leg_length_m": 0.0}),
        (CompassWalker, {"leg_length_m": -1.0}),
        (CompassWalker, {"foot_to_mass_m": -0.1}),
        (CompassWalker, {"foot_to_mass_m": 1.0}),
        (CompassWalker, {"foot_to_mass_m": 1.5}),
        (CompassWalker, {"foot_to_mass_m": 1.0, "leg_inertia_kg_m2": 1.0}),
        (CompassWalker, {"leg_mass_kg": 0.0}),
        (CompassWalker, {"hip_mass_kg": -1.0}),
        (CompassWalker, {"leg_inertia_kg_m2": -1e-9}),
        (CompassWalker, {"foot_radius_m": -1e-9}),
        (CompassWalker, {"foot_radius_m": 0.5}),
        (Kneed, {"foot_radius_m": 1.0}),
        (CompassWalker, {"type": "kneed"}),
        (Config, {"gravity_m_s2": 0.0}),
        (Config, {"gravity_m_s2": -9.81}),
        (Config, {"slope_rad": math.pi / 2}),
        (Config, {"slope_rad": -math.pi / 2}),
        (Config, {"strides": 0}),
        (Config, {"strides": 10_001}),
        (Config, {"seed": -1}),
        (Config, {"equations": "printed"}),
        (Contact, {"exponent": 0.99}),
        (Contact, {"exponent": 3.01}),
        (Contact, {"stiffness": 0}),
        (Contact, {"damping": -1}),
        (Contact, {"static_friction": -0.1}),
        (Contact, {"static_friction": 0.5}),
        (Contact, {"dynamic_friction": 0.91}),
        (Contact, {"stiction_velocity": 1000}),
        (Contact, {"friction_velocity": 100}),
        (Contact, {"units": "si", "stiction_velocity": 100, "friction_velocity": 1000}),
        (Contact, {"stiction_velocity": 0}),
        (Contact, {"full_damping_penetration": 0}),
        (Contact, {"full_damping_penetration": 1e5}),
        (Contact, {"pad_pitch": 0}),
        (Contact, {"pad_pitch": "wide"}),
        (SolverSettings, {"rtol": 0}),
        (SolverSettings, {"rtol": 0.11}),
        (SolverSettings, {"atol": 0}),
        (SolverSettings, {"method": "euler"}),
    ],
)
def test_values_beyond_the_bounds_are_rejected(block: type[Block], values: dict[str, Any]) -> None:
    assert not admits(block, **values)


@pytest.mark.parametrize("value", [True, "1", None, [1.0], math.nan, math.inf, -math.inf, 10**400])
def test_number_must_be_finite_and_not_a_bool_or_string(value: Any) -> None:
    assert not admits(Config, gravity_m_s2=value)
    assert not admits(Config, strides=value)


def test_leg_mass_is_half_way_up_the_leg_by_default() -> None:
    assert CompassWalker(leg_length_m=0.3).foot_to_mass_m == 0.15


def test_outputs_are_sorted_and_unique() -> None:
    assert Config.model_validate({"outputs": ["forces", "states", "forces"]}).outputs == ("states", "forces")


def test_adams_units_are_converted_to_si() -> None:
    in_si = Contact().to_si()
    assert in_si.stiffness == pytest.approx(3.98107170553e11, rel=1e-11)  # 1e5 * 10**6.6
    assert in_si.damping == 9.0e4
    assert in_si.full_damping_penetration == pytest.approx(1e-4, rel=1e-15)
    assert (in_si.stiction_velocity, in_si.friction_velocity) == (0.1, 1.0)
    assert (in_si.exponent, in_si.static_friction, in_si.dynamic_friction) == (2.2, 0.9, 0.7)


@given(st.floats(1.0, 3.0), st.floats(1e-3, 1e3))
def test_contact_force_does_not_depend_on_the_units_of_the_law(exponent: float, penetration_mm: float) -> None:
    law = Contact(exponent=exponent).to_si()
    in_adams_units = 1e5 * penetration_mm**exponent
    assert law.stiffness * (penetration_mm / 1000) ** exponent == pytest.approx(in_adams_units, rel=1e-12)


@given(st.floats(1.0, 3.0))
def test_contact_defaults_are_equal_in_both_unit_systems(exponent: float) -> None:
    adams, si = Contact(exponent=exponent).to_si(), Contact(units="si", exponent=exponent).to_si()
    assert adams.units == si.units == "si"
    for name in ("stiffness", "damping", "full_damping_penetration", "stiction_velocity", "friction_velocity"):
        assert getattr(adams, name) == pytest.approx(getattr(si, name), rel=1e-14)


def test_si_values_are_not_converted() -> None:
    law = Contact(units="si", stiffness=1e5, exponent=1.0, damping=90.0).to_si()
    assert (law.stiffness, law.damping, law.full_damping_penetration) == (1e5, 90.0, 1e-4)


@pytest.mark.parametrize(("key", "meant"), [("walker.nonsense", ""), ("walker.slope_rad", "; did you mean slope_rad?")])
def test_unknown_key_suggests_no_unrelated_block(key: str, meant: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load(sets=[f"{key}=1"])
    assert caught.value.message.startswith(f"--set {key}=1: {key}: unknown key (1){meant or '; allowed'}")
