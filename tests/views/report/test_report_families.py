"""Tests of the report's section on families of gaits."""

from dataclasses import replace

from synthetic_results import config, families, families_that_move, simulate

from walkerlab.config.loader import load
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections import families as section
from walkerlab.views.report.sections.families import MIN_MARK_DISTANCE, gait_diagram, separate_marks
from walkerlab.views.report.words import words


def test_section_is_omitted_without_families():
    assert section.section(Results(load().config)) is None


def test_families_section_states_the_stable_range_and_describes_chaos():
    made = section.section(Results(load().config, families()))
    (paragraph, table) = made.blocks
    assert "stable from 1\u00a0deg to 4\u00a0deg" in made.finding
    assert "0.2 per step" in paragraph.text
    assert "the attractor of the rigid model disappears: the walker falls." in paragraph.text
    assert [cell.text for cell in next(iter(table.groups.values()))[0]][:4] == ["flip", "rigid", "1", "4"]


def test_answers_state_if_the_ground_limits_gaits_or_basins():
    summary = dict(families()["continuation"].summary)
    told = {"model": "contact", "value": 3.2, "outcome": "off-pad"}
    summary["endings"] = [
        {**told, "period": 1, "said": "Above 3.2 deg it trips."},
        {**told, "period": 2, "said": "Above 3.3 deg it trips."},
    ]
    said = section.findings(summary)
    assert "Above 3.2 deg it trips." in said
    assert "Above 3.3 deg it trips." not in said
    ended = [{"said": "3 of 9 walks slid away.", "ground": True}, {"said": "2 of 9 walks fell.", "ground": False}]
    assert words.parts("basin.grounds", {"endings": ended}) == ["3 of 9 walks slid away."]
    assert words.parts("basin.grounds", {}) == []


def test_diagram_marks_gaits_with_stored_motion():
    walk = simulate()
    made = gait_diagram(Results(config(), {"continuation": families_that_move(walk)}))
    first, second = made.gaits
    assert (first.stable, second.stable) == (True, False)
    assert first.x < second.x
    assert first.walker.track["t"].size > 2
    assert [first.slope_rad, second.slope_rad] == [0.02, 0.09]
    assert gait_diagram(Results(config(), families())) is None


def test_marks_do_not_overlap_and_stable_gaits_keep_theirs():
    walk = simulate()
    (mark, _) = gait_diagram(Results(config(), {"continuation": families_that_move(walk)})).gaits
    near, far = replace(mark, x=mark.x + 0.9 * MIN_MARK_DISTANCE), replace(mark, x=mark.x + MIN_MARK_DISTANCE)
    assert separate_marks([mark, near, far]) == (mark, far)
    assert separate_marks([replace(mark, stable=False), near, far]) == (near,)
