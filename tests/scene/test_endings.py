"""Tests of the sentences that say how walks end, in which a trip on a pad differs from a fall."""

from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.outcome import OUTCOME_TEXTS, Outcome
from walkerlab.scene.walk_outcomes import Pads, describe_endings, ground_causes

PAPER = load().config
COUNTS = {"walked": 150, "off-pad": 178, "fell": 32, "no-answer": 7}


def test_every_outcome_has_a_description_and_a_colour():
    for told in ("does", "did", "advice", "colour"):
        assert len({getattr(OUTCOME_TEXTS[outcome], told) for outcome in Outcome}) == len(Outcome)
    assert all(OUTCOME_TEXTS[outcome].why for outcome in Outcome if outcome is not Outcome.WALKED)


def test_walks_ended_by_pads_are_distinguished_from_falls():
    pads = Pads((0.15, 0.15), (0.31, 0.36), "rigid")
    first, second = describe_endings(COUNTS, PAPER, contact=True, pads=pads)
    assert (first["outcome"], first["walks"], first["of"], first["ground"]) == ("off-pad", 178, 360, True)
    assert first["said"] == (
        "178 of 360 walks hit the side of a pad or tripped on the one they left (off-pad). The pads end them, "
        "not the walker. The pads' pitch is 0.15 m, the rigid gait's step length; their last steps were 0.31 to 0.36 m "
        "long. Try contact.terrain=after-mid-swing or contact.pad_pitch=own."
    )
    assert (second["said"], second["ground"]) == ("32 of 360 walks fell.", False)


def test_completed_walks_and_missing_gaits_are_not_listed_as_early_ends():
    assert describe_endings({"answered": 3, "no-answer": 1}, PAPER, contact=False) == []
    assert describe_endings({"walked": 3}, PAPER, contact=True) == []


def test_kneed_walkers_are_advised_to_use_a_plane():
    kneed = load(Path("kneed"), ("contact.terrain=checkerboard", "contact.pad_pitch=own")).config
    assert ground_causes("off-pad", kneed, contact=True)[-1] == "Try contact.terrain=plane."


def test_ground_properties_are_suggested_as_causes_only_for_contact_walks():
    assert ground_causes("lifted-off", PAPER, contact=False) == []
    assert "contact.stiffness" in ground_causes("lifted-off", PAPER, contact=True)[0]
    assert "contact.static_friction" in ground_causes("slid", PAPER, contact=True)[0]
