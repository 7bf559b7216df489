"""Tests of `walkerlab check`: digits, conventions, balances, and the command."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import walkerlab
from walkerlab.api.memory import add_blocks
from walkerlab.config.check import Check, digits_of, parse_printed
from walkerlab.config.files import BUILTIN_FOLDER, builtin_names
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.check.answer import check_gait
from walkerlab.evidence.check.gaits import gait_near
from walkerlab.evidence.check.plain_walker import energy, plain_walker, take_step
from walkerlab.evidence.check.printed import Item, equal_digits
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker
from walkerlab.views.cli.main import program

PUBLISHED = BUILTIN_FOLDER / "published"
SCRIPT = {
    "walker": {
        "type": "straight-legs", "leg_length_m": 1.2, "leg_mass_kg": 0.5, "leg_mass_below_hip_m": 0.5,
        "leg_inertia_kg_m2": 0.02, "hip_mass_kg": 1.0, "foot_radius_m": 0.2,
    },
    "gravity_m_s2": 1.0,
    "slope_rad": 0.01,
}  # fmt: skip


def run(*words):
    return CliRunner().invoke(program(), ["check", *map(str, words)])


def written(folder, text, name="my.yaml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "right", "agreeing"),
    [
        ("0.20", 0.2049, 2), ("0.20", 0.2051, 2), ("0.20", 0.2101, 1), (".1998325", 0.19983247, 7),
        ("-0.199623", -0.19983247, 3), ("150.13", 150.1421, 4), ("1.2e-3", 0.00123, 2), ("0.20", -0.2, 0),
        ("0", 0.3, 1),
    ],
)  # fmt: skip
def test_printed_digits_agree_if_they_are_the_right_value_rounded_or_truncated(text, right, agreeing):
    assert equal_digits(digits_of(text), right) == agreeing


@pytest.mark.parametrize(
    ("text", "right", "fits"),
    [
        ("< 1", 0.9, True), ("less than one", 1.1, False), ("0.51 ± 0.02", 0.528, True), ("0.51 +/- 0.02", 0.54, False),
        ("0.4 to 0.6", 0.5, True), ("-0.19+0.56i", -0.1901 + 0.5576j, True), ("-.19 ± .56j", -0.1901 - 0.5576j, True),
        ("1.2 × 10^-3", 0.00121, True), ("1.2e-003", 0.00121, True), ("−0.25", -0.2504, True),
    ],
)  # fmt: skip
def test_bounds_uncertainties_and_complex_values_are_read(text, right, fits):
    assert Item("any", "any", 0, text).fits(right) is fits


@pytest.mark.parametrize(
    "text", ["0,25", "abc", "0.1 s", "1e400", "5 × 10^400", "", "1 2", "0x10", "--3", "0.5±", "[1, 2, 3]", "∞"]
)
def test_text_that_is_not_a_printed_value_is_not_read(text):
    assert parse_printed(text) is None


@pytest.mark.parametrize(
    "name", ["paper", "kneed", "kneed-round-feet", "round-feet", "simplest", "torso", "kuo", "level", "kneed-level"]
)
def test_compiled_and_plain_models_agree_on_built_in_walkers(name):
    config = load(Path(name)).config
    answer = check_gait(config.model_copy(update={"check": Check()}))
    assert answer["routes"]["agree"]
    assert answer["routes"]["difference"] < 1e-12


def test_plain_model_of_a_check_includes_knee_damping():
    config = load(Path("kneed"), ["walker.knee.damping_N_m_s_per_rad=0.02"]).config
    answer = check_gait(config.model_copy(update={"check": Check()}))
    assert answer["routes"]["difference"] < 1e-12


def test_unexplained_state_of_a_kneed_walker_raises_no_error():
    # The search for a gravity with which the state is periodic must try only positive values.
    state = ["0.1877", "-0.2884", "-1.1014", "-0.9399"]
    answer = walkerlab.check("kneed", {"state": state, "period_s": "0.5643"})
    assert answer.finding == "different, unexplained"


def test_mistake_is_found_under_a_convention_other_than_the_stated_one():
    """The script that computed the state has a wrong strike, and its relative second angle is taken for an absolute
    one.
    """
    config = load(PUBLISHED / "passivewalker-2009.yaml", ["check.angles.second=absolute"]).config
    (explanation,) = check_gait(config)["explanations"]
    assert explanation["kind"] == "mistake"
    assert explanation["what"].startswith(
        "the second angle is relative, stance leg minus swing leg, and the trailing leg's"
    )


def test_energy_is_constant_within_a_plain_swing():
    walker = plain_walker(load(Path("round-feet")).config)
    start = np.array(find_gaits(rigid_walker(load(Path("round-feet")).config), 0).gait.state)
    start[:2] += walker.slope
    step = take_step(walker, start)
    assert energy(walker, step.before) == pytest.approx(energy(walker, start), abs=1e-11)


def test_digits_are_counted_as_typed_with_or_without_quotes(tmp_path):
    check = "extends: paper\ncheck:\n  printed: {step_length_m: %s, period_s: '0.70'}\n"
    plain, quoted = (load(written(tmp_path, check % text)).config.check for text in ("0.3710", "'0.3710'"))
    assert plain.printed == quoted.printed == {"step_length_m": "0.3710", "period_s": "0.70"}


def test_published_state_is_explained_by_the_heel_strike_of_its_script():
    answer = check_gait(load(PUBLISHED / "passivewalker-2009.yaml").config)
    (explanation,) = answer["explanations"]
    assert (answer["finding"], explanation["kind"], explanation["digits"]) == ("explained", "mistake", 14)
    assert "−I × (trailing leg's rate − leading leg's rate)" in explanation["what"]
    whole, hip = answer["momenta"]
    assert (whole["conserved"], hip["conserved"]) == (True, False)
    # The extra term is the inertia times the relative rate of the legs before the strike.
    assert hip["residual"] == pytest.approx(3.15197e-4, rel=1e-4)


def test_state_of_the_paper_follows_from_its_sign_error():
    answer = walkerlab.check("paper", {"state": ["-0.2022", "0.1674", "-0.60", "-0.84"]})
    (explanation,) = answer.explanations
    assert answer.finding == "explained"
    assert explanation["what"].startswith("the term of the swing leg's squared rate in the equation of the stance leg")


def test_walk_by_eulers_method_comes_closest_to_a_published_gait_with_knees():
    answer = check_gait(load(PUBLISHED / "hsu-chen-2007.yaml").config)
    assert answer["finding"] == "different, unexplained"
    assert answer["closest"]["what"] == "the equations are integrated by Euler's method with a step of 0.001 s"
    assert not answer["periodic"]["is_periodic"]


@pytest.mark.parametrize(
    ("name", "finding"),
    [
        ("garcia-1998", "reproduced"), ("passivewalker-sim", "reproduced"), ("crane-2026-rocker", "reproduced"),
        ("crane-2026-kneed", "reproduced"), ("js117-compass", "reproduced"),
        ("compass-speeds", "different, unexplained"),
    ],
)  # fmt: skip
def test_checks_of_published_gaits_have_the_documented_findings(name, finding):
    answer = check_gait(load(PUBLISHED / f"{name}.yaml").config)
    assert (answer["finding"], answer["routes"]["agree"]) == (finding, True)


def test_extra_multiplier_of_minus_one_is_explained_by_a_section_at_the_heel_strike():
    gait = walkerlab.find_gait()
    multipliers = [f"{one.real:.4f}{one.imag:+.4f}i" for one in gait.multipliers]
    answer = walkerlab.check("paper", {"multipliers": [*multipliers[:2], "-1.0000"], "period_s": "0.7036"})
    assert [each["kind"] for each in answer.explanations] == ["mistake"]
    assert "adds a multiplier of -1" in answer.explanations[0]["what"]


def printed_with(origin, second, unit, order, positive):
    """Return the gait of the compass in some conventions, converted by hand."""
    swing, stance, dswing, dstance = walkerlab.find_gait().state
    tilt = 0.0174 if origin == "slope-normal" else 0.0
    angles = {"swing": (swing + tilt, dswing), "stance": (stance + tilt, dstance)}
    pairs = [angles[name] for name in order]
    if second == "relative":
        pairs[1] = (swing - stance, dswing - dstance)
    factor = (57.29577951308232 if unit == "deg" else 1.0) * (-1.0 if positive == "clockwise" else 1.0)
    numbers = [factor * pair[kind] for kind in (0, 1) for pair in pairs]
    return [f"{number:.6f}" for number in numbers]


OWN = ("vertical", "absolute", "rad", ("swing", "stance"), "counter-clockwise")
CONVENTIONS = [
    (origin, second, unit, ("stance", "swing"), positive)
    for origin in ("vertical", "slope-normal")
    for second in ("absolute", "relative")
    for unit in ("rad", "deg")
    for positive in ("counter-clockwise", "clockwise")
]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_stated_conventions_are_read(convention):
    names = ("from", "second", "unit", "order", "positive")
    angles = dict(zip(names, (*convention[:3], list(convention[3]), convention[4]), strict=True))
    answer = walkerlab.check("paper", {"state": printed_with(*convention)}, angles=angles)
    assert answer.finding == "reproduced"


@pytest.mark.parametrize(
    "convention", [each for each in CONVENTIONS if sum(map(str.__ne__, each[:3], OWN[:3])) < 2][::2]
)
def test_conventions_are_found_without_being_stated(convention):
    answer = walkerlab.check("paper", {"state": printed_with(*convention)})
    assert answer.finding == "explained"
    assert {each["kind"] for each in answer.explanations} == {"convention"}
    assert len(answer.explanations) == 1 or answer.undecided


def test_values_for_unit_gravity_or_for_a_stride_are_explained_as_conventions():
    gait = walkerlab.find_gait()
    stride = {"period_s": f"{2 * gait.period_s:.6f}", "step_length_m": f"{2 * gait.step_length_m:.6f}"}
    assert "a stride" in walkerlab.check("paper", stride).explanations[0]["what"]
    scaled = {"period_s": f"{gait.period_s * 9.81**0.5:.6f}", "step_length_m": f"{gait.step_length_m:.6f}"}
    told = [each["what"] for each in walkerlab.check("paper", scaled).explanations]
    assert "gravity is 1 m/s²" in told
    assert "time is in units of sqrt(L/g)" in told


def test_leg_length_without_the_foot_radius_is_recognised():
    right = find_gaits(rigid_walker(load(PUBLISHED / "passivewalker-2009.yaml").config), 0).gait
    short = {**SCRIPT, "walker": {**SCRIPT["walker"], "leg_length_m": 1.0}}
    config = add_blocks("round-feet", **short)
    answer = walkerlab.check(config, {"state": [f"{value:.8f}" for value in right.state]})
    assert answer.explanations[0]["what"] == "the stated leg length excludes the foot's radius"


def test_misprinted_parameter_is_found():
    right = load(Path("paper"), ["walker.hip_mass_kg=10", "slope_rad=0.0147"]).config
    state = find_gaits(rigid_walker(right), 0).gait.state
    answer = walkerlab.check("paper", {"state": [f"{value:.7f}" for value in state]})
    told = [each["what"] for each in answer.explanations]
    # With point feet, a different slope has the same effect as a late touch.
    assert told[0] == "slope_rad is 0.0147 (two digits are transposed)"
    assert all("is accepted as soon as" in what for what in told[1:])


def test_lost_sign_and_transposed_digits_are_recognised_as_misprints():
    lost = walkerlab.check("paper", {"state": ["-0.204200", "0.169400", "0.605819", "-0.861041"]})
    swapped = walkerlab.check("paper", {"state": ["-0.204200", "0.169400", "-0.605819", "-0.816041"]})
    assert lost.explanations[0]["what"] == "the sign of the printed swing rate is wrong"
    assert swapped.explanations[0]["what"] == "two digits of the printed stance rate are transposed"


def test_one_wrong_printed_value_is_reported_as_unexplained():
    answer = walkerlab.check("paper", {"period_s": "0.7064"})
    assert (answer.finding, answer.explanations) == ("different, unexplained", [])


def test_states_before_the_heel_strike_and_at_mid_stance_are_recognised(tmp_path):
    config = load(Path("paper")).config
    walker = plain_walker(config)
    tilt = np.array([0.0174, 0.0174, 0.0, 0.0])
    start = np.array(find_gaits(rigid_walker(config), 0).gait.state) + tilt
    step = gait_near(walker, start).step
    printed = [f"{value:.6f}" for value in step.before - tilt]
    assert walkerlab.check(config, {"state": printed}, instant="before-strike").finding == "reproduced"
    pair = walkerlab.check(config, {"state": ["-0.204200", "0.169400", "-0.605819", "-0.861041"]}, state_before=printed)
    assert pair.finding == "reproduced"
    assert [each["conserved"] for each in pair.momenta] == [True, True]
    assert abs(pair.energy_drift_J) < 1e-3
    wrong = walkerlab.check(
        config, {"state": ["-0.204200", "0.169400", "-0.705819", "-0.861041"]}, state_before=printed
    )
    assert [each["conserved"] for each in wrong.momenta] == [False, False]


def test_walkers_built_from_parts_cannot_be_checked():
    answer = walkerlab.check("parts", {"period_s": "0.70"})
    assert (answer.finding, answer["values"][0]["verdict"]) == ("not-comparable", "not-comparable")
    assert "walkers of type parts" in answer.reason


def test_gait_printed_for_a_slope_without_gaits_cannot_be_checked():
    level = load(Path("paper"), ["slope_rad=0"]).config
    answer = walkerlab.check(level, {"period_s": "0.70"})
    assert answer.finding == "not-comparable"


ODD = {
    "no block": ("extends: paper\n", "has no check block"),
    "unknown value": ("extends: paper\ncheck: {printed: {periods: 1}}\n", "Did you mean period_s?"),
    "decimal comma": ("extends: paper\ncheck: {printed: {period_s: '0,70'}}\n", "decimals follow a point"),
    "unit": ("extends: paper\ncheck: {printed: {period_s: 0.70 s}}\n", "without its unit"),
    "odd state": ("extends: paper\ncheck: {printed: {state: [1, 2, 3]}}\n", "state has 3 values"),
    "one value": ("extends: paper\ncheck: {printed: {state: 1}}\n", "state is one value, not a list"),
    "shank of a compass": (
        "extends: paper\ncheck: {angles: {order: [swing, shank]}, printed: {state: [1, 2, 3, 4]}}\n", "this walker has"
    ),
    "twice": ("extends: paper\ncheck: {angles: {order: [swing, swing]}}\n", "must name each body once"),
    "unknown key": ("extends: paper\ncheck: {print: {}}\n", "check.print: unknown key"),
    "a list": ("extends: paper\ncheck: [1]\n", "check"),
    "nested": ("extends: paper\ncheck: {printed: {state: {a: 1}}}\n", "check.printed"),
    "instant": ("extends: paper\ncheck: {instant: later}\n", "mid-stance"),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_malformed_check_files_are_refused_with_a_reason(name, tmp_path):
    text, words = ODD[name]
    done = run(written(tmp_path, text))
    assert done.exit_code == ConfigError.exit_code
    assert words in done.output
    assert "Traceback" not in done.output


def test_bad_file_does_not_prevent_the_check_of_the_others(tmp_path):
    written(tmp_path, "extends: paper\ncheck: {printed: {period_s: 0.7036}}\n", "good.yaml")
    written(tmp_path, "extends: paper\n", "bad.yaml")
    done = run(tmp_path, "--json")
    bad, good = json.loads(done.stdout)["checks"]
    assert done.exit_code == ConfigError.exit_code
    assert (bad["error"]["exit_code"], good["finding"]) == (3, "reproduced")


def test_answer_about_a_different_gait_has_the_documented_keys(tmp_path):
    file = written(tmp_path, "extends: paper\ncheck: {printed: {state: [-0.2, 0.1652, -0.6, -0.85]}}\n")
    done = run(file, "--json")
    answer = json.loads(done.stdout)
    assert done.exit_code == 0
    assert {"values", "periodic", "momenta", "explanations", "nearest_gait"} <= answer.keys()
    assert {"name", "printed", "right", "digits", "verdict", "evidence"} <= answer["values"][0].keys()
    assert {"residual", "digits"} <= answer["periodic"].keys()
    assert {"about", "residual", "unit"} <= answer["momenta"][0].keys()


def test_answer_says_which_values_a_cause_explains_and_how_far_off_others_are():
    words = " ".join(run("published/adams-compass.yaml").output.split())
    assert "partly explained: the 4 angles and rates and the spectral radius follow to the last digit if" in words
    assert "; the mean energy, step period 1, step period 2, the speed and the step length do not." in words
    assert "mean energy (J) 150.13 150.2413 3 of 5, off by 11 units reproduced to 3 digits" in words
    assert "After one exact step it has changed by 0.0045 (angles in rad, rates times sqrt(L/g)), 45 units" in words


def test_state_can_be_given_on_the_command_line():
    done = run("-c", "paper", "--state", "[-0.2042, 0.1694; -0.6058 -0.8610]")
    assert done.exit_code == 0
    assert "Right: 4 printed values reproduced to the last digit." in done.output


def test_init_writes_a_form_for_a_printed_gait(tmp_path):
    file = tmp_path / "my-gait.yaml"
    done = CliRunner().invoke(program(), ["init", str(file), "--check", "--type", "kneed"])
    assert f"walkerlab check {file}" in done.output
    assert "the file prints no values" in run(file).output
    filled = file.read_text().replace("period_s: null", "period_s: 0.5643")
    file.write_text(filled)
    assert "Right: 1 printed value reproduced" in run(file).output


def test_published_configs_have_unique_names_and_are_on_a_page():
    assert not {path.stem for path in PUBLISHED.glob("*.yaml")} & {*builtin_names()}
    assert len([*PUBLISHED.glob("*.yaml")]) >= 12
    docs = Path(__file__).parents[3] / "docs"
    pages = "".join((docs / name).read_text() for name in ("published.md", "published-right.md"))
    assert all(f"## {path.stem}\n" in pages for path in PUBLISHED.glob("*.yaml"))


def test_every_command_accepts_a_published_gait(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = "published/garcia-1998.yaml"
    assert "Right: 2 printed values reproduced" in run(name).output
    shown = CliRunner().invoke(program(), ["fixedpoint", "-c", name])
    assert shown.exit_code == 0, shown.output
    assert "0.199832" in shown.output


def test_form_for_a_printed_gait_has_only_keys_that_check_reads(tmp_path):
    file = tmp_path / "my-gait.yaml"
    CliRunner().invoke(program(), ["init", str(file), "--check", "--type", "kneed"])
    keys = [line.partition(":")[0] for line in file.read_text().splitlines() if line[:1].isalpha()]
    assert keys == ["extends", "name", "walker", "gravity_m_s2", "slope_rad", "check"]
