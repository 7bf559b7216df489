"""Check that planted mistakes are named, right gaits reproduced, and unknown mistakes left unexplained."""

import random
from itertools import islice

import mistaken_knees
import mistaken_walks
import numpy as np
import pytest
from mistaken_walks import MISTAKES, UNLISTED, answer_to, checked_config, config_of, gait, gait_with, walkers
from printed_forms import odd_file, printed_in, random_convention
from typer.testing import CliRunner

from walkerlab.evidence.check.answer import check_gait
from walkerlab.views.cli.main import program

SAMPLE = [(words, (6, 10, 4)[place % 3]) for place, words in enumerate([*MISTAKES][::3])]
KNEED_SAMPLE = [(words, (6, 10)[place % 2]) for place, words in enumerate([*mistaken_knees.MISTAKES][1::8])]


@pytest.fixture(scope="module")
def walker():
    """Return a random walker and its gait without mistakes."""
    return next(walkers(7))


def first_gait_with(mistake, found, step=mistaken_walks.step):
    """Return the first walker that has a gait with the mistake, and that gait."""
    gaits = ((legs, gait_with(legs, state, mistake, step)) for legs, state in found)
    return next((legs, each) for legs, each in gaits if each is not None)


def test_hand_written_walker_has_the_same_gait_as_the_package(walker):
    legs, state = walker
    found, _ = gait(legs, state)
    np.testing.assert_allclose(found, state, rtol=0, atol=1e-11)


def test_hand_written_kneed_model_has_the_same_gait_as_the_walker_in_the_package():
    legs, state = next(walkers(1, mistaken_knees.random_knees, mistaken_knees.config_of))
    found, _ = gait(legs, state, mistaken_knees.step)
    np.testing.assert_allclose(found, state, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("words", "digits"), SAMPLE)
def test_planted_mistake_is_named(words, digits):
    legs, found = first_gait_with(MISTAKES[words], walkers(7))
    answer = answer_to(config_of(legs), *found, digits)
    causes = [each["what"] for each in answer["explanations"]]
    assert answer["finding"] == "explained"
    assert any(words in cause for cause in causes)
    assert digits == 4 or len(causes) == 1


@pytest.mark.parametrize(("words", "digits"), KNEED_SAMPLE)
def test_mistake_planted_into_a_walker_with_knees_is_named(words, digits):
    found = walkers(1, mistaken_knees.random_knees, mistaken_knees.config_of)
    legs, printed = first_gait_with(mistaken_knees.MISTAKES[words], found, mistaken_knees.step)
    answer = answer_to(mistaken_knees.config_of(legs), *printed, digits)
    (cause,) = [each["what"] for each in answer["explanations"]]
    assert words in cause


@pytest.mark.parametrize("digits", [3, 6, 12])
def test_correct_gait_is_reproduced_and_needs_no_explanation(digits):
    for legs, state in islice(walkers(digits), 2):
        answer = answer_to(config_of(legs), *gait(legs, state), digits)
        assert (answer["finding"], answer["explanations"]) == ("reproduced", [])
        assert answer["routes"]["agree"]


@pytest.mark.parametrize(("name", "digits"), [("leak", 4), ("drag", 10), ("spring", 6), ("bounce", 4)])
def test_mistake_that_the_check_does_not_know_stays_unexplained(walker, name, digits):
    legs, state = walker
    found = gait_with(legs, state, {name: UNLISTED[name]})
    answer = answer_to(config_of(legs), *found, digits)
    assert (answer["finding"], answer["explanations"]) == ("different, unexplained", [])


@pytest.mark.parametrize("changes", [2, 5])
def test_conventions_that_differ_in_several_ways_are_found(walker, changes):
    legs, state = walker
    form = random_convention(random.Random(changes), changes)
    texts = printed_in(form, config_of(legs), *gait(legs, state), 8)
    answer = check_gait(checked_config(config_of(legs), {"angles": {}, "printed": texts}))
    assert answer["finding"] == "explained"
    assert {each["kind"] for each in answer["explanations"]} == {"convention"}


def test_mistake_is_named_together_with_the_unstated_conventions():
    """The state is printed from the slope's normal and with the legs exchanged, and the config states neither."""
    words = "the legs' inertia is left out"
    legs, ((swing, stance, dswing, dstance), period) = first_gait_with(MISTAKES[words], walkers(7))
    texts = {"state": [f"{value:.7f}" for value in (stance, swing, dstance, dswing)], "period_s": f"{period:.7f}"}
    answer = check_gait(checked_config(config_of(legs), {"angles": {}, "printed": texts}))
    (cause,) = [each["what"] for each in answer["explanations"]]
    conventions = "angles are measured from the slope’s normal and the order is stance, swing"
    assert cause == f"{conventions}, and {words}"


def test_check_of_a_damaged_file_gives_an_answer_or_a_clean_error(tmp_path):
    generator = random.Random(5)
    for number in range(8):
        file = tmp_path / f"odd-{number}.yaml"
        file.write_bytes(odd_file(generator))
        done = CliRunner().invoke(program(), ["check", str(file)])
        assert done.exit_code in (0, 3), done.output
        assert "Traceback" not in done.output
