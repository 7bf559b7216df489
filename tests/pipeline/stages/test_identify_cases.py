"""Check the answers that docs/identify-cases.md states."""

import re
from pathlib import Path

import pytest

import walkerlab

DOCS = Path(__file__).parents[3] / "docs"
PAGE = " ".join((DOCS / "identify-cases.md").read_text(encoding="utf-8").replace("> ", "").split())


def identify(name, fit, level, **options):
    return walkerlab.identify(DOCS / "downloads" / name, "paper", fit, level=level, **options).summary


def test_rigid_model_fits_the_film_with_too_light_a_hip():
    prior = {"walker.leg_length_m": [1.0, 0.001]}
    fit = ["slope_deg", "walker.hip_mass_kg"]
    summary = identify("film.csv", fit, "angles", prior=prior, nuisance=["clock_rate"])
    slope, hip, _ = summary["estimates"]
    assert summary["models"][0]["fit"] == "fits-but"
    assert any("the prior of 1 for" in reason for reason in summary["models"][0]["reasons"])
    assert f"{slope['value']:.3f} ± {slope['standard_error']:.3f}" in PAGE
    assert f"{hip['value']:.2f} ± {hip['standard_error']:.2f}" in PAGE
    assert summary["prior"][0]["distance"] > 3.0


NUMBER = r"\d+\.?\d*"


def numbers_in(sentence):
    return [float(number) for number in re.findall(NUMBER, sentence)]


def stated_like(sentence):
    """Yield the numbers of each sentence on the page that has the same words. They may differ from the answer, because
    rounding decides where a hopeless search ends.
    """
    words = f"({NUMBER})".join(re.escape(part) for part in re.split(NUMBER, sentence))
    return ([float(number) for number in match.groups()] for match in re.finditer(words, PAGE))


@pytest.mark.parametrize(
    ("name", "level", "fit"),
    [
        ("treadmill.csv", "angles", ["slope_deg", "walker.leg_length_m"]),
        (
            "table-3.csv",
            "steps",
            {
                "slope_deg": [0.1, 6],
                "walker.hip_mass_kg": [1, 30],
                "walker.leg_length_m": [0.6, 2],
                "walker.foot_to_mass_m": [0.1, 0.59],
            },
        ),
    ],
)
def test_no_walker_fits_a_person_or_the_tables_of_the_paper(name, level, fit):
    summary = identify(name, fit, level)
    verdict = summary["models"][0]
    assert verdict["fit"] == "misfit"
    assert any(
        stated == pytest.approx(numbers_in(verdict["reason"]), rel=0.1) for stated in stated_like(verdict["reason"])
    )


def test_steps_of_the_treadmill_recording_take_six_tenths_of_a_second():
    walk = walkerlab.read_walk(DOCS / "downloads" / "treadmill.csv")
    assert walk.summary["steps"] == 3
    assert walk.summary["step_periods_s"] == pytest.approx([0.597] * 3, abs=0.02)


def test_page_quotes_both_misfit_verdicts():
    assert len(re.findall(r"No choice of slope_deg", PAGE)) == 2
