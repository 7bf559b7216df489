"""Check that a friction law of a user is treated like that of ADAMS, by what it declares."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple, get_args

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.schema import Contact
from walkerlab.errors import ConfigError
from walkerlab.evidence.benchmarks.trials import CREEP_FACTOR, stiff_ground_trial
from walkerlab.exchange.engine_scene import CREEP_LOAD, contact_target
from walkerlab.extensions import WORDS
from walkerlab.physics.ground import friction
from walkerlab.physics.ground.friction import (
    FRICTION_LAWS,
    Coulomb,
    Frictionless,
    friction_coefficient,
    steepest_change,
)
from walkerlab.physics.orbits.contact_gait import scale_laws, set_rigidity, why_no_gait
from walkerlab.physics.orbits.rigid_limit import STICTION_SERIES, series_settings
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.stages.contact_sim import warn_of_unresolved_slip
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.scene.contact import contact_scene, ground_laws, scene_measures, start_state

START = (-0.2042, 0.1694, -0.605819, -0.861041)


class Regularised(NamedTuple):
    """Friction mu tanh(v / v_0), which is smooth and has no larger coefficient at rest."""

    mu: float
    v_0: float

    @classmethod
    def from_contact(cls, contact):
        return cls(contact.dynamic_friction, contact.stiction_velocity)

    largest = property(lambda self: self.mu)
    rising_until = property(lambda self: 3.0 * self.v_0)
    sliding_from = property(lambda self: 3.0 * self.v_0)

    def scale_creep(self, factor):
        return self._replace(v_0=factor * self.v_0)

    def describe(self):
        return f"friction of {self.mu:g} tanh(v / {self.v_0:g} m/s)"


@pytest.fixture
def own(monkeypatch):
    """Return the scene of the paper's walker on ground with that law."""
    monkeypatch.setitem(
        friction.friction_coefficient._bodies,
        Regularised,
        lambda law, slip: (-law.mu * math.tanh(slip / law.v_0), -law.mu / law.v_0 / math.cosh(slip / law.v_0) ** 2),
    )
    monkeypatch.setitem(FRICTION_LAWS.laws, "coulomb", Regularised)
    return contact_scene(load().config, 0.3714)


class Wordless(NamedTuple):
    """Friction law with half of its parts missing."""

    mu: float

    @classmethod
    def from_contact(cls, contact):
        return cls(contact.dynamic_friction)

    largest = rising_until = property(lambda self: self.mu)


def test_error_lists_what_an_incomplete_friction_law_lacks(monkeypatch):
    monkeypatch.setitem(FRICTION_LAWS.laws, "coulomb", Wordless)
    with pytest.raises(ConfigError) as said:
        contact_scene(load().config, 0.3714)
    assert str(said.value) == (
        "the friction law Wordless ('coulomb') is incomplete: it lacks sliding_from, scale_creep, describe, "
        "a case @friction_coefficient.case(Wordless)."
    )


@pytest.mark.parametrize("stage", ["contact-sim", "report"])
def test_incomplete_law_is_rejected_before_anything_runs(stage, monkeypatch, tmp_path):
    config = load().config
    monkeypatch.setitem(FRICTION_LAWS.laws, "coulomb", Wordless)
    # Only laws of other packages are checked beforehand.
    monkeypatch.setitem(WORDS, "friction", ("none",))
    with pytest.raises(ConfigError, match="it lacks sliding_from, scale_creep, describe"):
        execute(config, stage, RunFolder(tmp_path, "paper"))
    assert [*tmp_path.rglob("*.h5")] == []


def test_law_with_several_formulas_must_define_their_switching_points(own, monkeypatch):
    monkeypatch.setitem(friction.switching_count._bodies, Regularised, lambda law: 2)
    with pytest.raises(ConfigError, match=r"lacks a case @sample_switching\.case\(Regularised\)\.$"):
        contact_scene(load().config, 0.3714)


def test_error_of_a_compiled_walk_names_the_friction_law_that_lacks_a_formula(own):
    wordless = replace(own, walker=own.walker._replace(friction=Wordless(0.5)))
    with pytest.raises(TypeError, match=r"^friction_coefficient has no case for Wordless: "):
        wordless.walk(start_state(own, START), 1, Tolerances("radau5", 1e-7, 1e-9, 1000))


def test_every_friction_option_of_the_config_has_a_law():
    assert set(FRICTION_LAWS.laws) == set(get_args(Contact.model_fields["friction"].annotation))
    for word in FRICTION_LAWS.laws:
        assert Contact(friction=word).has_friction == (ground_laws(Contact(friction=word))[1].largest > 0.0)


@pytest.mark.parametrize("word", FRICTION_LAWS.laws)
def test_stated_properties_of_a_law_match_its_coefficient(word):
    law = ground_laws(Contact(friction=word))[1]
    slips = np.linspace(0.0, 3.0, 3001)
    found = [-friction_coefficient(law, slip)[0] for slip in slips]
    assert max(found) == pytest.approx(law.largest, rel=1e-5)
    rising = [mu for mu, slip in zip(found, slips, strict=True) if slip <= law.rising_until]
    assert rising == sorted(rising)
    assert len({mu for mu, slip in zip(found, slips, strict=True) if slip >= law.sliding_from}) == 1
    for slip in slips:
        slowed = friction_coefficient(law.scale_creep(0.25), 0.25 * slip)[0]
        assert slowed == pytest.approx(friction_coefficient(law, slip)[0], rel=1e-12)
        assert steepest_change(law, slip) >= -friction_coefficient(law, slip)[0] - 1e-12


def test_steepness_bound_holds_for_a_friction_law_that_drops_faster_than_it_rises():
    law = Coulomb(static=0.9, dynamic=0.7, stiction_velocity=0.1, friction_velocity=0.11)
    span = 1e-4
    changes = [
        friction_coefficient(law, slip + span)[0] - friction_coefficient(law, slip)[0]
        for slip in np.linspace(0.1, 0.11, 201)
    ]
    assert max(changes) == pytest.approx(0.003, rel=1e-3)
    assert max(changes) <= steepest_change(law, span) <= 1.01 * max(changes)


def test_friction_laws_have_different_descriptions():
    said = [ground_laws(Contact(friction=word))[1].describe() for word in FRICTION_LAWS.laws]
    assert len(set(said)) == len(said)
    assert said[0] == (
        "ADAMS's Coulomb friction, with a coefficient of 0.9 at a slip velocity of 0.1 m/s and 0.7 above 1 m/s"
    )


def test_result_names_its_friction_law(own):
    assert scene_measures(own)["friction"] == "friction of 0.7 tanh(v / 0.1 m/s)"


def test_rigid_limit_reduces_the_creep_of_any_law(own):
    stiff = set_rigidity(own.walker, 1.0).friction.v_0
    assert stiff < 0.1
    setting = series_settings(STICTION_SERIES)[-1]
    assert scale_laws(own.walker, *setting[2:]).friction.v_0 == pytest.approx(0.1 * setting.stiction_velocity_factor)
    trial = stiff_ground_trial(load().config, START, 0.3714, 2)
    assert trial.walker.friction.v_0 == pytest.approx(0.1 * CREEP_FACTOR)


def test_friction_law_too_weak_for_the_slope_explains_the_missing_gait(own):
    assert why_no_gait(own.walker) is None
    weak = own.walker._replace(friction=Regularised(0.01, 0.1))
    assert "0.01 is below the slope's 0.0174" in why_no_gait(weak)[0]
    assert "without friction" in why_no_gait(own.walker._replace(friction=Frictionless()))[0]


def test_unresolved_slip_of_any_law_is_reported(own):
    said = []
    progress = SimpleNamespace(note=said.append)
    warn_of_unresolved_slip(1e-9, own, progress)
    assert said == []
    warn_of_unresolved_slip(0.1, own, progress)
    assert "0.3 m/s" in said[0]


def test_creep_target_for_engines_is_computed_from_any_friction_law(own):
    target = contact_target(SimpleNamespace(ours=own.walker))
    assert target.friction == pytest.approx(0.7 * math.tanh(3.0))
    assert target.creep_velocity == pytest.approx(0.1 * math.atanh(CREEP_LOAD / 0.7), rel=1e-9)
    assert contact_target(SimpleNamespace(ours=own.walker._replace(friction=Frictionless()))) is None
