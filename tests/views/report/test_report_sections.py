"""Tests of the sections of the report: the verdict comes first, and each result has a section."""

import base64
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from real_results import real
from synthetic_results import (
    COORDINATES,
    EVERYTHING,
    PAPER_ROWS,
    SLOPE,
    compare,
    config,
    contact_sim,
    fixedpoint,
    gait_summary,
    paper_row,
    simulate,
    stored,
)

from walkerlab.config.loader import load
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.report.blocks import (
    PAPER_PAGE,
    Code,
    Paragraph,
    Picture,
    Player,
    Results,
    Section,
    Shares,
    Statements,
)
from walkerlab.views.report.gaits import SETS, coordinate, tabulate_gaits, work_columns
from walkerlab.views.report.registry import SECTIONS, lead, sections_of
from walkerlab.views.report.sections import motion
from walkerlab.views.report.sections.walks import assumptions
from walkerlab.views.report.tables import Table
from walkerlab.views.report.tracks import Track, slip_since_touch
from walkerlab.views.report.words import words

SHARES = "0 are inputs, 1 is reproduced, 1 explained, 2 contradicted by other values of the paper and 0 not reproduced"
NO_GAIT = "no gait at a slope of 0.2 rad: nothing repeats itself"
WITHOUT_GAIT = (
    LeftOut("fixedpoint", NO_GAIT),
    LeftOut("simulate", f"it needs fixedpoint: {NO_GAIT}"),
    LeftOut("contact-sim", f"it needs fixedpoint: {NO_GAIT}"),
)


def sections(stages=None, *, absent=(), failed=(), sets=(), **changed):
    made = {name: make() for name, make in EVERYTHING.items() if stages is None or name in stages} | changed
    found = sections_of(Results(config(*sets), made, (), absent, failed=frozenset(failed)))
    return {section.anchor: section for section in found}


def plain(text):
    return text.replace("\u00a0", " ").replace("\u202f", " ")


def texts(section):
    """Return everything that a section says, in one string."""
    return plain(repr(section.blocks).replace("\\xa0", " "))


def blocks(section, kind):
    return [block for block in section.blocks if isinstance(block, kind)]


def rows(section, index=0):
    return {
        row[0].text: [plain(cell.text) for cell in row[1:]]
        for rows in blocks(section, Table)[index].groups.values()
        for row in rows
    }


def test_verdict_comes_first_and_provenance_last():
    anchors = list(sections())
    assert anchors[0] == "verdict"
    assert anchors[-2:] == ["left-out", "provenance"]


def test_each_result_adds_its_sections():
    assert {"gait"} <= sections(["fixedpoint"]).keys()
    assert {"assumptions", "steps", "motion"} <= sections(["simulate"]).keys()
    assert {"contact", "steps", "motion"} <= sections(["contact-sim"]).keys()
    assert {"paper-numbers", "errata"} <= sections(["compare"]).keys()


def test_only_the_opening_paragraph_mentions_a_missing_contact_model():
    found = sections(["fixedpoint", "simulate"], sets=("contact=null",))
    assert not {"contact", "paper-numbers", "errata"} & found.keys()
    spoken = " ".join(texts(found[name]) for name in found if name != "provenance").lower()
    assert "contact" not in spoken
    said = lead(config("contact=null"), "rigid-only")
    assert said.endswith("alone. The contact model was not used: the config has no contact block.")
    assert said.lower().count("contact") == 2
    assert lead(config(), "paper").endswith("as a rigid model and as a contact model.")
    simplest = load(Path("simplest")).config
    assert "not used: the walker's feet have next to no mass" in lead(simplest, "simplest")


def test_missing_gait_is_stated_first():
    first = sections([], absent=WITHOUT_GAIT, failed=["fixedpoint"])["verdict"].blocks[0]
    assert isinstance(first, Paragraph)
    assert first.tone == "bad"
    assert NO_GAIT in first.text
    assert "simulate and contact-sim" in first.text


def test_stage_that_was_not_requested_is_not_a_failure():
    absent = [LeftOut("contact-sim", "the config has no contact block")]
    said = blocks(sections(["simulate"], absent=absent)["verdict"], Paragraph)
    assert [one.tone for one in said] == ["plain"]


def test_verdict_opens_with_results_failures_and_conclusions():
    def opening(**changed):
        return plain(sections(**changed)["verdict"].blocks[0].text)

    assert opening() == (
        f"Both models walk all 4 steps, and the gait is stable; of the 4 values that the paper prints, {SHARES}. "
        "Eq. A.5 has a sign error; use the corrected equations."
    )
    slower = {"step_periods_s": [0.7, 0.7, 0.7, 0.707]}
    other = stored("compare", {}, {"departures": ["hip_mass_kg 12 instead of 10"]})
    said = opening(compare=other, **{"contact-sim": contact_sim(**slower)})
    assert "takes 1 % more time than in the rigid gait" in said
    uneven = opening(sets=("ground.roughness_m=0.001",), compare=other, **{"contact-sim": contact_sim(**slower)})
    assert uneven == "Both models walk all 4 steps, and the gait is stable."  # Every step differs from the others.
    fallen = opening(compare=other, **{"contact-sim": contact_sim("fell", 3)})
    assert fallen == (
        "The rigid model walks all 4 steps, the contact model walks 3 steps and then falls, and the gait is stable. "
        "Start nearer to a gait."
    )


def test_title_and_verdict_of_a_driven_walker_name_its_drive_and_cost():
    driven = ("slope_deg=0", "push_off.impulse_N_s=4", "walker.hip.spring_N_m_per_rad=10")
    by = "driven by a push-off of 4 N s, with a hip spring of 10 N m/rad"
    gait = stored("fixedpoint", {}, {**fixedpoint().summary, "cost_of_transport": 0.00998})
    costly = {"fixedpoint": gait, "contact-sim": contact_sim(cost_of_transport=0.0195)}
    found = sections(sets=driven, **costly)
    cost = "its cost of transport is 0.00998 in the rigid gait and 0.0195 on compliant ground"
    assert f"The walker is {by}; {cost}." in plain(found["verdict"].blocks[0].text)
    assert "Arrows show the ground forces and the push-off" in texts(found["motion"])
    assert "Cost of transport" in texts(found["glossary"])
    assert by in plain(lead(config(*driven), "level"))
    assert "driven" not in plain(sections()["verdict"].blocks[0].text)


def test_spring_alone_is_not_a_drive():
    sprung = ("walker.hip.spring_N_m_per_rad=10",)
    said = plain(lead(config(*sprung), "paper"))
    assert "with a hip spring of 10 N m/rad" in said
    assert "driven" not in said
    assert "driven" not in plain(sections(sets=sprung)["verdict"].blocks[0].text)


def test_energy_columns_that_are_zero_to_rounding_are_omitted():
    record = {"work_per_step_J": {"gravity": -2e-14, "push_off": 1.69, "hip": 0.0}}
    told = [column.title for column in work_columns(str) if column.value(record) is not None]
    assert told == ["work of the push-off per step (J)"]


def test_missing_figures_of_the_paper_are_explained():
    figure = Picture("Figure 2. Sticks.", "As walked.", "Legs.")
    made = {name: make() for name, make in EVERYTHING.items()}
    (said,) = blocks(motion.figures(Results(config(), made, (figure,))), Paragraph)
    assert "Figures 1, 3 and 4 show no results" in said.text


def test_table_3_states_the_origin_of_periods_and_means():
    (_, third) = blocks(sections()["tables"], Table)
    for part in ("last completed stride", "begins with the left step", "last five"):
        assert part in third.note


def test_omissions_are_listed_with_their_reasons():
    walk = simulate(left_out=[{"what": "forces", "why": "not among the outputs", "saves": "2 numbers"}])
    found = sections([], absent=WITHOUT_GAIT, failed=["fixedpoint"], simulate=walk)["left-out"]
    assert rows(found) == {
        "fixedpoint": [NO_GAIT, ""],
        "simulate and contact-sim": ["needs fixedpoint", ""],
        "forces": ["not among the outputs", "2 numbers"],
    }


def test_shared_reason_is_given_once_above_its_consequences():
    why = "the config has no contact block"
    absent = [LeftOut(name, why, saves="contact code") for name in ("contact-sim", "compare")]
    absent.append(LeftOut("figure 6", f"it needs contact-sim: {why}"))
    found = sections([], absent=absent)["left-out"]
    assert rows(found) == {
        "contact-sim and compare": [why, "contact code"],
        "figure 6": ["needs contact-sim and compare", ""],
    }


def test_complete_page_says_that_nothing_is_missing():
    assert "Every result of the pipeline is available" in texts(sections()["left-out"])


def test_fall_is_mentioned_before_a_completed_walk():
    (walks, *_) = blocks(
        sections(**{"contact-sim": contact_sim("fell", 3, hip=0.4999, damping_ratio=0.03)})["verdict"], Statements
    )
    fallen, walked, _gait = walks.items
    assert (fallen.about, fallen.badge, fallen.tone) == ("Contact model", "fell", "bad")
    assert (walked.about, walked.badge, walked.tone) == ("Rigid model", "walked", "good")
    for part in ("3 of 4 steps", "2.1 s", "0.5 m above the slope", "damping ratio of 0.03", "Start nearer to a gait"):
        assert part in plain(fallen.text)


@pytest.mark.parametrize(
    ("outcome", "changed", "said"),
    [
        ("slid", {"slips_m": [0.001, -0.12]}, "−0.12 m"),
        ("off-pad", {"step_lengths_m": [0.36, 0.35]}, "30 mm behind"),
        ("no-heel-strike", {}, "3.19 s"),
        ("budget-exhausted", {"rhs_evaluations": 4_000_000}, "4,000,000 right-hand sides"),
        ("lifted-off", {"min_normal_force_N": -17.0}, "pull with 17 N"),
        ("rejected", {"step_periods_s": [], "step_lengths_m": [], "slips_m": []}, "2 of 4 steps"),
    ],
)
def test_every_outcome_of_a_walk_is_described_with_its_values(outcome, changed, said):
    walk = contact_sim(outcome, 2, **changed)
    (walks, *_) = blocks(sections(["simulate"], **{"contact-sim": walk})["verdict"], Statements)
    assert said in plain(walks.items[0].text)


def test_printed_values_are_counted_by_verdict():
    printed = sections()["printed"]
    (shares,) = blocks(printed, Shares)
    assert printed.finding == f"Of 4 values that the paper prints, {SHARES}."
    assert shares.parts == (("reproduced", 1, "good"), ("explained", 1, "fair"), ("contradicted", 2, "bad"))
    assert sum(count for _, count, _ in shares.parts) == len(PAPER_ROWS)


def test_verdict_lists_printed_values_by_result():
    said = {finding.about: finding.text for finding in blocks(sections()["printed"], Statements)[0].items}
    assert list(said) == ["Reproduced:", "Explained:", "Contradicted:"]
    assert said["Contradicted:"] == "Table 3 (all 2)."


def test_verdict_names_the_most_serious_errors_with_measurements():
    (error,) = blocks(sections()["printed"], Statements)[-1].items
    assert "A.5 row 2" in error.about
    assert "energy drifts by 0.13 J" in error.text


def test_every_headline_belongs_to_an_erratum():
    errata = Path(find_spec("walkerlab.evidence.paper.prose").submodule_search_locations[0]) / "errata.j2"
    assert [start for start in words.terms("verdict.headlines") if f"where: {start}" not in errata.read_text()] == []


def test_other_scenes_have_the_paper_on_a_separate_page():
    other = stored("compare", compare().groups, {**compare().summary, "departures": ["slope_rad 0.05"]})
    found = sections(compare=other)
    assert "printed" not in found
    assert "paper" not in texts(found["verdict"]).lower()
    assert found["paper-numbers"].page == PAPER_PAGE
    (said,) = blocks(found["paper-numbers"], Paragraph)
    assert "slope_rad 0.05" in said.text


def test_tables_of_the_paper_show_our_values_too_and_omit_empty_columns():
    first, third = blocks(sections()["tables"], Table)
    assert [column.title for column in first.columns] == ["symbol", "quantity", "paper", "used here", "where"]
    assert [column.title for column in third.columns] == ["quantity", "paper, MATLAB", "corrected"]
    assert next(iter(third.groups.values()))[0][0].text == "left step period, t_left (s)"


def test_difference_of_the_models_is_given_in_every_measure():
    assert rows(sections()["models"]) == {
        "at the same time": ["0.11", "0.11"],
        "at the same phase of each step": ["0.017", "0.017"],
    }


def test_every_printed_value_is_listed_by_its_place_in_the_paper():
    (table,) = blocks(sections()["paper-numbers"], Table)
    assert [(title, len(rows)) for title, rows in table.groups.items()] == [
        ("eq. 11", 1),
        ("Table 3", 2),
        ("Table 2", 1),
    ]


def test_model_without_values_has_no_column():
    rows_without = [paper_row("eq. 11", "x", "1", "reproduced", "", corrected=1.0)]
    (table,) = blocks(sections([], compare=compare(rows_without))["paper-numbers"], Table)
    heads = [column.title for column in table.columns]
    assert "corrected" in heads
    assert "contact model" not in heads


def test_errata_are_shown_with_measurements():
    assert rows(sections()["errata"])["A.5 row 2"][-1] == "energy drifts by 0.13 J"


def test_both_sets_of_equations_are_shown_side_by_side():
    found = rows(sections()["gait"])
    assert found["stable"] == ["no", "yes"]
    assert found["step period T (s)"] == ["0.700000"] * 2
    assert found["multipliers λ₁"] == ["0.3626 + 0.4603i"] * 2


def test_coordinates_of_any_walker_have_symbols():
    names = ("theta_1", "theta_1_shank", "theta_torso", "dtheta_1_shank", "q_7")
    assert [coordinate(name) for name in names] == [
        "θ₁, swing leg (rad)",
        "θ₁, swing shank (rad)",
        "θ, torso (rad)",
        "θ̇₁, swing shank (rad/s)",
        "q_7 (rad)",
    ]


def test_equations_without_a_gait_are_omitted():
    summary = dict(fixedpoint().summary)
    summary["equation_sets"] = {"corrected": summary["equation_sets"]["corrected"], "as-printed": {"gaits_found": 0}}
    (table,) = blocks(sections([], fixedpoint=stored("fixedpoint", {}, summary))["gait"], Table)
    assert [column.title for column in table.columns] == ["quantity", "value"]


def test_table_says_which_assumptions_of_the_rigid_model_hold():
    good = rows(sections()["assumptions"])
    assert [row[-1] for row in good.values()] == ["holds", "holds", "does not hold (ignored)", "holds"]
    walk = simulate(min_normal_force_N=-1.0, energy_drift_J=0.13, max_friction_ratio=2.0)
    bad = rows(sections([], simulate=walk)["assumptions"])
    fails = "does not hold"
    assert [row[-1] for row in bad.values()] == [fails, fails, "does not hold (ignored)", fails]


def test_steps_of_both_models_are_shown_side_by_side():
    found = rows(sections(**{"contact-sim": contact_sim("fell", 2)})["steps"])
    assert found["2"] == ["0.7000", "0.7000", "0.3700", "0.3700", "0.9300"]
    assert found["4"] == ["0.7000", "–", "0.3700", "–", "–"]


def test_steps_are_printed_with_as_many_digits_as_the_numerical_error_allows():
    error = {"step_period_s": 4e-6, "step_length_m": 4e-4, "end_time_s": 1e-5}
    section = sections(simulate=simulate(numerical_error=error), **{"contact-sim": contact_sim()})["steps"]
    assert rows(section)["2"][:4] == ["0.70000", "0.7000", "0.370", "0.3700"]
    said = " ".join(block.text for block in section.blocks if isinstance(block, Paragraph))
    assert said.startswith("Numerical error: 4")
    assert said.endswith("by a second walk with a hundred times tighter tolerances (rigid model).")
    assert not [block for block in sections()["steps"].blocks if isinstance(block, Paragraph)]


def test_first_and_last_steps_of_a_long_walk_are_listed():
    found = rows(sections(["x"], simulate=stored("simulate", {}, simulate(steps=2000).summary))["steps"])
    assert 10 < len(found) < 40
    assert {"1", "2000"} <= found.keys()


def test_contact_walk_values_are_listed():
    found = rows(sections()["contact"])
    assert found["static penetration"][0] == "58.8 µm"
    assert found["damping ratio"][0] == "3.71"
    assert found["energy balance error"][0] == "7 × 10⁻⁹ J"


def test_page_states_the_config_to_rerun(tmp_path):
    asked = ("slope_deg=3", "contact.stiffness=1e6")
    code = blocks(sections(sets=asked)["provenance"], Code)[0].text
    file = tmp_path / "again.yaml"
    file.write_text(code)
    assert config(file=file) == config(*asked)


def test_provenance_lists_key_digest_commit_and_command_of_each_result():
    made = simulate()
    said = texts(sections([], simulate=made)["provenance"])
    for part in (made.identity.key, made.digest(), "0123456789abcdef", "walkerlab report", "1.25"):
        assert part in said


def channels(walker):
    """Return the channels of a walker in the player, by name."""
    floats = np.frombuffer(base64.b64decode(walker.track.pack()), "<f4").reshape(len(walker.track.channels), -1)
    return dict(zip(walker.track.channels, floats.astype(float), strict=True))


def test_stick_figures_are_at_the_positions_of_the_walker():
    (player,) = sections(["simulate"])["motion"].blocks
    assert isinstance(player, Player)
    found = channels(player.walkers[0])
    for leg in "01":
        reach = np.hypot(found["hx"] - found[f"fx{leg}"], found["hy"] - found[f"fy{leg}"])
        assert np.allclose(reach, 1.0, atol=1e-6)
    # The first leg swings from a step behind the foothold to a step ahead, where it then stands.
    gait = real("fixedpoint").summary
    assert found["fx0"][0] == pytest.approx(-gait["step_length_m"], abs=1e-6)
    second = np.abs(found["t"] - 1.5 * gait["period_s"]).argmin()
    assert (found["fx0"][second], found["fy0"][second]) == pytest.approx((gait["step_length_m"], 0.0), abs=2e-3)
    assert (found["fx1"][0], found["fy1"][0]) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_stills_cover_the_whole_walk():
    (player,) = sections()["motion"].blocks
    left, top, width, height = player.view
    points = np.array([joint for walker in player.walkers for still in walker.stills for joint in still])
    x = points[:, 0] * np.cos(SLOPE) - points[:, 1] * np.sin(SLOPE)
    y = points[:, 0] * np.sin(SLOPE) + points[:, 1] * np.cos(SLOPE)
    assert left <= x.min()
    assert x.max() <= left + width
    assert top <= y.min()
    assert y.max() <= top + height


def test_thinning_keeps_jumps_and_the_largest_force():
    time = np.concatenate((np.linspace(0.0, 1.0, 1001), np.linspace(1.0, 2.0, 1001)))
    force = np.ones(time.size)
    force[1234] = 9.0
    angle = np.where(np.arange(time.size) <= 1000, 1.0, -1.0)
    thin = Track({"t": time, "a0": angle, "n0": force, "n1": 0.0 * force}).thin(0.05)
    assert thin["t"].size < 100
    assert thin["n0"].max() == 9.0
    assert thin.end == 2.0
    before, after = np.flatnonzero(thin["t"] == 1.0)[[0, -1]]
    assert (thin["a0"][before], thin["a0"][after]) == (1.0, -1.0)


def test_slip_is_counted_from_touch_and_zero_in_the_air():
    time = np.linspace(0.0, 4.0, 4001)
    touching = (time < 1.0) | (time > 3.0)
    slip = slip_since_touch(time, np.full(time.size, 0.5), touching)
    assert slip[-1] == pytest.approx(0.5, abs=1e-3)
    assert not slip[~touching].any()
    assert slip[500] == pytest.approx(0.25, abs=1e-3)


def test_walk_without_stored_states_has_no_picture():
    walk = simulate()
    assert "motion" not in sections([], simulate=stored("simulate", {}, walk.summary))


def test_section_needs_one_function_and_one_registry_entry():
    extra = Section("accuracy", "Accuracy", (Paragraph("Measured."),))
    assert extra in sections_of(Results(config()), (*SECTIONS, lambda results: extra))
    assert extra not in sections_of(Results(config()), (*SECTIONS, lambda results: None))


def test_report_imports_no_plotting_or_compiler():
    heavy = (
        "matplotlib",
        "numba",
        "scipy",
        "walkerlab.physics.mechanics",
        "walkerlab.physics.hybrid",
        "walkerlab.scene.rigid",
    )
    code = f"import sys, walkerlab.views.report.stage; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_opening_paragraph_names_config_change_slope_and_equations():
    said = plain(lead(config("slope_deg=3", "equations=as-printed"), "paper@slope_deg=3"))
    for part in ("Config paper", "changed by slope_deg=3", "0.05236 rad (3°)", "as the paper prints them", "2 strides"):
        assert part in said


def test_opening_paragraph_lists_the_features_of_the_walker():
    torso = {"mass_kg": 0.5, "above_hip_m": 0.2}
    kneed, compass = (load(Path(name)).config for name in ("kneed", "torso"))
    said = plain(lead(load(Path("kneed"), [f"walker.torso={torso}"]).config, "kneed"))
    assert "a walker with kneed legs of 1 m, point feet and a torso of 0.5 kg, 2.1 kg in all, on a slope of" in said
    said = plain(lead(compass, "torso"))
    assert (
        "legs of 1 m and 5 kg each, a hip of 5 kg and a torso of 5 kg, on a slope of 0.0174 rad (0.997°). The" in said
    )
    assert "torso" not in lead(kneed, "kneed")


def test_gaits_have_headings_only_if_there_are_two_sets_of_equations():
    gait = gait_summary() | {"chosen": True, "objection": ""}
    every = {name: [gait, gait | {"chosen": False, "objection": "it scuffs"}] for name in SETS}
    heads = [
        [*tabulate_gaits({name: every[name] for name in sets}, COORDINATES).groups] for sets in (["corrected"], [*SETS])
    ]
    assert heads == [[""], ["as printed", "corrected"]]
    assert [row[-1].text for row in next(iter(tabulate_gaits(every, COORDINATES).groups.values()))] == [
        "chosen",
        "it scuffs",
    ]


def test_finding_states_the_required_friction_if_the_config_has_no_contact():
    walk = simulate()
    walk = stored("simulate", walk.groups, walk.summary | {"max_friction_ratio": 0.203})
    made = assumptions(Results(config("contact=null"), {"simulate": walk}))
    assert "The stance foot does not slip: needs friction, 0.203" in made.finding


def test_page_names_the_friction_law():
    assert "There is creeping friction of its own kind." in texts(sections()["contact"])
