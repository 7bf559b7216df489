"""What the report says of families of gaits."""

import sys
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.report.results import Results
from walkerlab.report.sections import families as section

sys.path.append(str(Path(__file__).parent.parent / "figures"))
from synthetic_families import families


def test_a_run_without_families_has_no_such_section():
    assert section.section(Results(load().config)) is None


def test_the_finding_is_the_stable_range_and_the_paragraph_has_the_chaos_and_its_end():
    made = section.section(Results(load().config, families()))
    (paragraph, table) = made.blocks
    assert "stable from 1\u00a0deg to 4\u00a0deg" in made.finding
    assert "0.2 a step" in paragraph.text
    assert "leaves its attractor: fell" in paragraph.text
    assert [cell.text for cell in table.bodies[0].rows[0]][:4] == ["flip", "rigid", "1", "4"]
