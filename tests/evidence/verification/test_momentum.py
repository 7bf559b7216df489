"""Check that momentum balances on compliant ground, and that slightly wrong walks violate the balance."""

import numpy as np
import pytest

from walkerlab.config.analyses import Case
from walkerlab.evidence.verification import starts
from walkerlab.evidence.verification.catalogue import config_of, package_cases
from walkerlab.evidence.verification.starts import (
    MAX_UNKNOWN,
    MEASURE,
    add_midpoints,
    impulse,
    integration_errors,
    momentum_balance,
    momentum_finding,
    prepare_start,
    split,
)
from walkerlab.evidence.verification.verdict import NotMeasured

CASES = {case.name: case for case in package_cases()}


def ready_for(name):
    return prepared_for(CASES[name])


def prepared_for(case):
    config = config_of(case)
    start = prepare_start(config, case)
    return config, start.scene, start.start, case


@pytest.mark.parametrize("name", ["paper", "leg-inertia", "foot-40-percent", "friction-0", "dropped-1-cm", "moon"])
def test_momentum_gain_equals_the_impulse_of_ground_and_gravity(name):
    found = momentum_balance(*ready_for(name))
    assert found.residual <= 1e-7 + found.unsure
    assert found.unsure < 1e-5


@pytest.mark.parametrize(
    "changed", [{"hip_mass_kg": 10.01}, {"leg_mass_kg": 5.005}, {"foot_to_mass_m": 0.501}, {"leg_inertia_kg_m2": 0.05}]
)
def test_momentum_does_not_balance_for_a_slightly_changed_walker(changed):
    config, *ready = ready_for("paper")
    other = config.model_copy(update={"walker": config.walker.model_copy(update=changed)})
    assert not momentum_finding(other, *ready).ok


def test_momentum_does_not_balance_if_gravity_is_wrong_by_a_thousandth():
    config, *ready = ready_for("paper")
    heavier = config.model_copy(update={"gravity_m_s2": 1.001 * config.gravity_m_s2})
    assert not momentum_finding(heavier, *ready).ok


def test_momentum_is_not_measured_with_a_pinned_foot():
    case = Case(name="x", expected=("walked",), reason="r", config={"contact": {"stance": "pinned"}})
    assert momentum_finding(*prepared_for(case)) == NotMeasured(MEASURE, "the pin transmits forces as well")


def test_momentum_is_not_measured_if_slip_is_below_the_tolerance():
    ready = ready_for("stiction-1e-7")
    found = momentum_balance(*ready)
    assert found.unresolved > MAX_UNKNOWN > found.unsure
    said = momentum_finding(*ready)
    assert isinstance(said, NotMeasured)
    assert "below the tolerance" in said.why


def test_momentum_is_not_measured_if_the_quadrature_does_not_converge(monkeypatch):
    monkeypatch.setattr(starts, "MAX_UNKNOWN", 1e-9)
    said = momentum_finding(*ready_for("paper"))
    assert isinstance(said, NotMeasured)
    assert "do not settle" in said.why


def test_momentum_error_of_very_fast_feet_is_relative_to_their_momentum():
    case = Case(name="x", expected=("lifted-off",), reason="r", config={"start": [-0.2, 0.16, 1e6, 1e6]})
    assert momentum_finding(*prepared_for(case)).ok


def test_simpson_sums_report_their_uncertainty():
    times = add_midpoints(np.array([0.0, 1.0, 1.5, 4.0]))
    cubic = (times**3)[:, None]
    np.testing.assert_allclose(impulse(times, cubic)[:, 0], np.array([0.0, 1.0, 1.5, 4.0]) ** 4 / 4.0)
    kink = np.maximum(0.0, times - 1.25)[:, None]
    assert integration_errors(times, kink)[[0, 2]] == pytest.approx([0.0, 0.0])
    assert integration_errors(times, kink)[1] > 0.0


def test_uncertain_intervals_are_split_into_four():
    times = add_midpoints(np.array([0.0, 1.0, 2.0]))
    assert split(times, np.array([False, True])).tolist() == [0.0, 1.0, 1.25, 1.5, 1.75, 2.0]
