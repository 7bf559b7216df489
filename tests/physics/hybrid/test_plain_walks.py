"""Compare random contact walks with the plain integration: a few of scripts/contact_campaign.py."""

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "scripts" / "contact_campaign.py"
# straight legs, free and pinned, on every terrain; knees, free and pinned
SEEDS = (18, 3, 19, 1, 0, 40, 8, 2, 29, 117, 69)


@pytest.fixture(scope="module")
def campaign():
    spec = importlib.util.spec_from_file_location("contact_campaign", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["contact_campaign"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", SEEDS)
def test_random_walks_agree_with_an_independent_integration(campaign, seed):
    one = campaign.compare(campaign.both(seed), steps=1)
    assert one.wrong == []
    # If numerical errors are large, they could hide a fault.
    assert max(error for judged in one.judged[1:] for error in judged.error.values()) < 1e-5


@pytest.mark.parametrize("seed", [1, 4, 5, 7, 11])
def test_driven_walks_agree_with_an_independent_integration(campaign, seed):
    """The drives are a torque between the legs and push-offs, one of which lasts until its held knee is released."""
    one = campaign.compare(campaign.driven(seed), steps=2)
    assert one.wrong == []
    assert one.steps == 2  # By then the torque acts on the other leg.
    assert max(error for judged in one.judged[1:] for error in judged.error.values()) < 1e-4


@pytest.mark.parametrize("seed", [0, 4, 7, 8, 11, 12])
def test_walks_over_random_heights_agree_with_an_independent_integration(campaign, seed):
    one = campaign.compare(campaign.uneven(seed), steps=2)
    assert one.wrong == []
    assert max(error for judged in one.judged[1:] for error in judged.error.values()) < 1e-4


@pytest.mark.parametrize("seed", [6, 25])
def test_walks_whose_feet_pass_below_uneven_ground_agree_with_an_independent_integration(campaign, seed):
    """In the first, a foot must not count as stubbed. In the second, a loaded foot must not lose the ground."""
    assert campaign.compare(campaign.passing(seed), steps=1).wrong == []


def test_walks_with_bouncing_feet_agree_with_an_independent_integration(campaign):
    """The residual over rtol x (energy + work exchanged) is 0.02 at rtol 1e-9. With a rule of order 5 for the work it
    would be 41.
    """
    one = campaign.compare(campaign.explicit(17), steps=2)
    assert one.wrong == []
    assert max(one.residuals) < 0.1 * campaign.BALANCED


def test_short_campaign_covers_every_kind_of_ground(campaign):
    grounds = {campaign.both(seed).ground for seed in SEEDS}
    assert {f"paper, {terrain}, {stance}" for terrain in campaign.TERRAINS for stance in ("free", "pinned")} <= grounds
    assert any(ground.startswith("kneed") and ground.endswith("pinned") for ground in grounds)
    assert any(ground.startswith("kneed") and ground.endswith("free") for ground in grounds)
