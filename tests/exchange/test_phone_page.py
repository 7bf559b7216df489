"""Check the answers that the page 'From a phone to parameters' shows."""

import re
from pathlib import Path

import walkerlab

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_rigid_fit_of_the_film_gives_the_hip_mass_on_the_page(tmp_path):
    page = (DOCS / "phone.md").read_text(encoding="utf-8")
    printed = re.search(r"gives a hip of\s+([\d.]+) ± ([\d.]+) kg", page)
    config = tmp_path / "mine.yaml"
    config.write_text(re.search(r"```yaml\n(# mine.yaml\n.*?)```", page, re.DOTALL)[1], encoding="utf-8")
    fit = {"slope_deg": None, "walker.hip_mass_kg": None}
    answer = walkerlab.identify(str(DOCS / "downloads" / "film.csv"), config, fit=fit, level="angles").summary
    mass = next(each for each in answer["estimates"] if each["key"] == "walker.hip_mass_kg")
    assert (f"{mass['value']:.1f}", f"{mass['standard_error']:.1f}") == printed.groups()
    assert answer["models"][0]["fit"] == "fits-but"
