"""What people read on stdout: a headline in words, symbols and units, digits that count, long rows cut short."""

import pytest

from walkerlab.cli.answers import answer, elided, multiplier, verdict
from walkerlab.cli.text import aligned, described_summary, width

GAIT = {
    "state": [-0.2042, 0.1694, -0.6058, -0.861],
    "multipliers": [[0.36331, 0.45959], [0.36331, -0.45959], [0.216, 0.0]],
    "period_s": 0.70360123456789,
    "step_length_m": 0.37143,
    "spectral_radius": 0.58586,
    "stable": True,
    "equations": "corrected",
    "slope_rad": 0.0174,
    "gaits_found": 2,
}
WALK = {
    "outcome": "walked",
    "advice": "",
    "steps": 20_000,
    "step_periods_s": [0.7] * 20_000,
    "step_lengths_m": [0.37] * 20_000,
    "rhs_evaluations": 123,
}


def test_multipliers_are_written_as_complex_numbers():
    assert multiplier(GAIT["multipliers"], 0) == "0.3633 + 0.4596 i"
    assert multiplier(GAIT["multipliers"], 1) == "0.3633 − 0.4596 i"
    assert multiplier(GAIT["multipliers"], 2) == "0.2160"


def test_the_gait_is_a_sentence_and_a_table_with_printed_beside_corrected():
    printed = {**GAIT, "equations": "as-printed", "state": [-0.2022, 0.1674, -0.6006, -0.8466]}
    lines = answer("fixedpoint", {**GAIT, "equation_sets": {"as-printed": printed, "corrected": GAIT}})
    assert lines[0].startswith("On a slope of 0.0174 rad (0.997°) there is a stable gait")
    assert lines[2].split() == ["corrected", "as", "printed", "unit"]
    assert lines[3].split() == ["θ₁", "−0.204200", "−0.202200", "rad"]
    assert "0.70360123456789" not in "\n".join(lines)


def test_a_walker_with_more_angles_has_its_own_names():
    kneed = {
        **GAIT,
        "state": [0.1, 0.2, 0.3, 1.0, 1.1, 1.2],
        "state_names": ["hip", "knee", "foot", "dhip", "dk", "df"],
    }
    text = "\n".join(answer("fixedpoint", kneed))
    assert "knee" in text
    assert "0.300000" in text


def test_without_a_gait_the_reason_is_the_answer():
    lines = answer("fixedpoint", {"slope_rad": 0.3, "reason": "the steepest gait is at 0.09 rad"})
    assert lines == ["No gait on a slope of 0.3 rad (17.2°): the steepest gait is at 0.09 rad."]


@pytest.mark.parametrize("stage", ["simulate", "contact-sim"])
def test_a_long_walk_is_a_few_short_lines(stage):
    lines = answer(stage, WALK)
    assert lines[0].endswith("walks all 20000 steps; the last takes 0.7000 s and is 0.3700 m long.")
    assert max(map(len, lines)) <= 120
    assert len(lines) < 12


def test_a_fall_is_told_with_its_advice():
    fall = {"outcome": "fell", "steps": 1, "step_periods_s": [0.7], "step_lengths_m": [0.4], "advice": "Start slower."}
    lines = answer("contact-sim", WALK | fall)
    assert lines[0].startswith("The contact model walks 1 step and then: fell")
    assert lines[-1] == "advice: Start slower."


def test_long_rows_keep_their_ends():
    assert elided(list(range(12))) == list(range(12))
    assert elided(list(range(100))) == [0, 1, 2, 3, 4, 5, "…", 98, 99]
    (line,) = described_summary({"values": list(range(1000))}, short=True)
    assert line.split()[:5] == ["values", "0", "1", "2", "3"]
    assert "(1000 of them" in line


def test_columns_line_up_under_letters_with_dots():
    first, second = aligned([["θ̇₁", "1"], ["ab", "2"]])
    assert width(first) == width(second) == 5


def test_the_verdict_of_a_run_is_three_lines():
    numbers = {"verdicts": {"reproduced": 3, "explained": 1}, "paper_numbers": []}
    cases = {"passed": 5, "failed": 0, "cases": [], "known": []}
    said = verdict({"fixedpoint": GAIT, "simulate": WALK, "compare": numbers, "stability": cases})
    assert len(said) == 3
    assert said[1] == "The rigid model walks 20000 steps (walked)."
    assert said[2].startswith("Of 4 numbers that the paper prints, 3 are reproduced and 1 is explained.")
