"""Random contact walks against the plain integration: a few of scripts/contact_campaign.py."""

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "contact_campaign.py"


@pytest.fixture(scope="module")
def campaign():
    spec = importlib.util.spec_from_file_location("contact_campaign", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["contact_campaign"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("walker", "seed"), [("compass", 1), ("compass", 2), ("kneed", 5), ("kneed", 7)])
def test_a_drawn_walk_ends_as_the_plain_integration_says(campaign, walker, seed):
    one = campaign.compare(campaign.WALKERS[walker](seed), steps=1, step_s=2e-5)
    assert one.outcome == one.expected
    # what halving the plain step still changes bounds what can be asked for
    assert one.apart_s < max(campaign.APART_S, 2.0 * one.own_s)


def test_a_flight_ends_the_walk_a_quarter_of_a_pendulum_time_after_the_foot_left(campaign):
    # the foot leaves where the force law nearly lets go, which the implicit method's dense output takes for a crossing
    one = campaign.compare(campaign.compass(5), steps=2, step_s=2e-5)
    assert one.outcome == one.expected == "lifted-off"
    assert one.apart_s < 1e-8
