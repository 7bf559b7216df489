"""Tests of loading: file, `extends`, `--set` and `--strides` give a config, or an error that says where and why."""

import math
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from walkerlab.config import schema
from walkerlab.config.files import BUILTIN_FOLDER, builtin_names
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.problems import explain_missing_feature
from walkerlab.config.reference import keys
from walkerlab.config.schema import Config, Contact, state_of
from walkerlab.config.walkers import contact_to_add
from walkerlab.config.writer import to_yaml
from walkerlab.errors import ConfigError

Write = Callable[..., Path]
Loaded = Callable[..., LoadedConfig]
Refused = Callable[..., str]


def test_paper_config_is_the_default() -> None:
    paper = load()
    assert paper.config == Config(contact=Contact(), source=paper.config.source)
    assert paper.config.source is not None
    assert "MSC ADAMS" in paper.config.source.title
    assert (paper.run_name, paper.warnings, paper.source) == ("paper", (), "built-in paper.yaml")


def test_built_in_config_can_be_loaded_by_name() -> None:
    assert load(Path("rigid-only")).config.contact is None


def test_file_takes_precedence_over_a_built_in_config(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("slope_deg: 2\n", "paper")
    monkeypatch.chdir(tmp_path)
    assert load(Path("paper")).config.slope_rad == math.radians(2)


def test_config_without_a_name_is_named_after_its_file(loaded: Loaded) -> None:
    assert loaded("slope_deg: 2\n").run_name == "mine"


def test_unsafe_file_name_is_replaced_with_a_warning(write: Write) -> None:
    loaded = load(write("slope_deg: 2\n", "my config.yaml"))
    assert loaded.run_name == "my-config"
    assert any("my-config" in warning for warning in loaded.warnings)


PACKAGES_LOADED = """
import sys
before = set(sys.modules)
{}
loaded = {{name.partition(".")[0] for name in set(sys.modules) - before}}
print(*sorted(loaded - set(sys.stdlib_module_names)))
"""


def packages_loaded_by(statements: str) -> set[str]:
    """Return the packages outside the standard library that some statements import, run in a fresh process."""
    command = [sys.executable, "-c", PACKAGES_LOADED.format(statements)]
    return set(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())


def test_loading_a_config_imports_few_modules() -> None:
    needed = packages_loaded_by("import ruamel.yaml, pydantic; type('A', (pydantic.BaseModel,), {})")
    loaded = packages_loaded_by("from walkerlab.config.loader import load; load()")
    assert "pydantic" in needed
    assert loaded <= {"walkerlab", *needed}


def test_theta_1_slightly_off_is_moved_until_both_feet_touch(loaded: Loaded) -> None:
    result = loaded("slope_deg: 2\nstart: [-0.245, 0.17, -0.6, -0.8]\n")
    assert list(result.config.start) == pytest.approx([-2 * math.radians(2) - 0.17, 0.17, -0.6, -0.8], abs=1e-15)
    assert len(result.warnings) == 1
    assert re.search(r"mine\.yaml:2:8: start: theta_1 moved from -0\.245 to -0\.2398", result.warnings[0])


@pytest.mark.parametrize("slope_deg", [1, 2, 5])
def test_null_theta_1_is_computed_from_the_slope(loaded: Loaded, slope_deg: float) -> None:
    result = loaded("start: [null, 0.17, -0.6, -0.8]\n", [f"slope_deg={slope_deg}"])
    swing = -2 * math.radians(slope_deg) - 0.17
    assert list(result.config.start) == pytest.approx([swing, 0.17, -0.6, -0.8], abs=1e-15)
    assert result.warnings == ()


@pytest.mark.parametrize("theta_1", [0, 6.1, -0.25, -0.229])
def test_theta_1_far_off_is_rejected_with_two_remedies(write: Write, theta_1: float) -> None:
    path = write(f"slope_deg: 2\nstart: [{theta_1}, 0.17, -0.6, -0.8]\n")
    with pytest.raises(ConfigError, match=r"mine\.yaml:2:8: start: theta_1 is .* but must be -0\.23981") as caught:
        load(path)
    assert "null for theta_1" in caught.value.advice
    assert f"{{instant: mid-step, state: [{theta_1}, 0.17, -0.6, -0.8]}}" in caught.value.advice


def test_mid_step_start_survives_a_round_trip_unchanged(loaded: Loaded) -> None:
    config = loaded("slope_rad: 0.0525\nstart: {instant: mid-step, state: [0, 0, 2.0, -0.4]}\n").config
    assert state_of(config.start) == (0.0, 0.0, 2.0, -0.4)
    assert loaded(to_yaml(config)).config == config


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ("{instant: mid-step, state: [0, 0, 2]}", "has 3 values; this walker needs 4"),
        ("{instant: mid-swing, state: [0, 0, 2, 1]}", "'mid-swing' is not allowed"),
        ("{instant: mid-step, state: [0, 0, null, 1]}", "null is not a number"),
        ("{instant: mid-step}", "needs the keys instant: mid-step and state"),
        ("{instant: mid-step, state: [0, 0, 2, 1], strides: 2}", "needs the keys instant: mid-step and state"),
        ("[-0.2, null, -0.6, -0.8]", "null is not a number"),
    ],
)
def test_malformed_start_is_rejected_with_the_reason(refused: Refused, start: str, said: str) -> None:
    assert said in refused(f"start: {start}\n")


def test_only_dependent_start_values_may_be_null(refused: Refused) -> None:
    message = refused("extends: torso\nslope_deg: 1\nstart: [null, null, null, -0.6, -0.8, null]\n")
    assert "value 2 is null, but only theta_1 and theta_torso and dtheta_torso can be computed here" in message


def test_dependent_start_values_and_rates_are_adjusted_with_a_warning(loaded: Loaded) -> None:
    swing = -2 * math.radians(1) - 0.17
    right = [swing, 0.17, -math.radians(1), -0.6, -0.8, -0.7]
    result = loaded("extends: torso\nslope_deg: 1\nstart: [-0.2, 0.17, -0.017, -0.6, -0.8, -0.702]\n")
    assert list(result.config.start) == pytest.approx(right, abs=1e-15)
    said = [re.search(r"start: (\w+) moved from \S+ to \S+ (\S+),", line) for line in result.warnings]
    assert [one.groups() for one in said if one] == [
        ("theta_1", "rad"), ("theta_torso", "rad"), ("dtheta_torso", "rad/s")
    ]  # fmt: skip
    computed = loaded("extends: torso\nslope_deg: 1\nstart: [null, 0.17, null, -0.6, -0.8, null]\n")
    assert list(computed.config.start) == pytest.approx(right, abs=1e-15)
    assert computed.warnings == ()


def test_swing_knee_is_straightened_at_the_start_with_a_warning(loaded: Loaded, refused: Refused) -> None:
    result = loaded("extends: kneed\nstart: [null, 0.19, -0.285, -0.05, -1.1, -0.3]\n")
    assert result.config.start[2] == result.config.start[0]
    assert result.config.start[5] == -0.3  # The knee may bend at mid-step, so its rate stays as stated.
    assert "theta_1_shank moved from -0.285" in result.warnings[-1]
    assert "theta_1_shank is -0.4 but must be" in refused(
        "extends: kneed\nstart: [null, 0.19, -0.4, -0.05, -1.1, -0.3]\n"
    )


def test_mid_step_knee_may_flex_but_not_hyperextend(loaded: Loaded, refused: Refused) -> None:
    bent = "extends: kneed\nstart: {instant: mid-step, state: [0.1, -0.1, -0.4, 1.0, -1.1, 1.0]}\n"
    assert state_of(loaded(bent).config.start)[2] == -0.4
    assert "knees do not bend beyond straight" in refused(bent.replace("-0.4", "0.4"))


PARTS = """walker:
  type: parts
  leg_length_m: 1
  bodies:
    - {name: leg 1, mass_kg: 5, centre_m: [0, -0.5]}
    - {name: leg 2, mass_kg: 5, centre_m: [0, -0.5]}
    - {name: trunk, mass_kg: 10, centre_m: [0, 0.3]}
  hinges:
    - {name: hip, parent: leg 2, parent_point_m: [0, 0], child: leg 1, child_point_m: [0, 0]}
    - {name: neck, parent: leg 2, parent_point_m: [0, 0], child: trunk, child_point_m: [0, 0]}
  feet: [{body: leg 1, centre_m: [0, -1]}, {body: leg 2, centre_m: [0, -1]}]
  couplings: [{body: trunk, of: [leg 1, leg 2], weights: [0.25, 0.75]}]
  legs: [[leg 1], [leg 2]]
"""


def test_start_angle_of_a_coupled_part_is_a_weighted_mean(loaded: Loaded) -> None:
    start = loaded(PARTS + "start: [-0.2, 0.2, null, -0.4, -0.8, null]\n").config.start
    assert list(start) == pytest.approx([-0.2, 0.2, 0.1, -0.4, -0.8, -0.7], abs=1e-15)


@pytest.mark.parametrize("terrain", ["plane", "after-mid-swing"])
def test_pad_pitch_without_pads_raises_a_warning(loaded: Loaded, terrain: str) -> None:
    (doubt,) = loaded(f"contact: {{terrain: {terrain}, pad_pitch: 0.4}}\n").warnings
    assert f"contact.pad_pitch has no effect on {terrain}" in doubt
    assert loaded("contact: {terrain: checkerboard, pad_pitch: 0.4}\n").warnings == ()


def test_absurdly_long_legs_raise_a_warning(loaded: Loaded) -> None:
    (said,) = loaded("walker: {leg_length_m: 1000, foot_to_mass_m: 500}\n").warnings
    assert said.endswith("mine.yaml:1:10: walker.leg_length_m is 1000 m; lengths are in m, not in mm")
    (said,) = loaded("extends: kneed\nwalker:\n  thigh:\n    length_m: 500\n").warnings
    assert said.endswith("mine.yaml:4:5: walker.thigh.length_m is 500 m; lengths are in m, not in mm")


def test_gravity_in_centimetres_raises_a_warning(loaded: Loaded) -> None:
    (said,) = loaded("gravity_m_s2: 981\n").warnings
    assert said.endswith("mine.yaml:1:1: gravity_m_s2 is 981; it is in m/s^2 (9.81 on earth), not in cm/s^2")
    for gravity in (1.0, 1.62, 9.81, 24.8):
        assert loaded(f"gravity_m_s2: {gravity}\n").warnings == ()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("controller: {kp: 1}\n", "walkerlab has no controllers; push_off and walker.hip drive a walker"),
        ("walker: {controls: 1}\n", "walkerlab has no controllers"),
        ("type: 3d\n", "walkerlab is planar"),
        ("walker: {type: 3D}\n", "walkerlab is planar"),
        ("walker: {type: runner}\n", "walkerlab has no running"),
        ("walker: {type: quadruped}\n", "walkerlab's walkers have two legs"),
    ],
)
def test_keys_for_features_out_of_scope_are_rejected_with_the_reason(refused: Refused, text: str, why: str) -> None:
    message = refused(text)
    assert f"; {why}" in message
    assert "did you mean" not in message


def test_existing_keys_and_configs_are_not_called_out_of_scope() -> None:
    names = {part for key in keys() for part in key.key.split(".")}
    assert [name for name in (*names, *builtin_names()) if explain_missing_feature(name)] == []


def test_error_in_a_question_block_points_to_its_key(loaded: Loaded) -> None:
    config = loaded("robustness:\n  to: [walker.hip_mass_kg, foo]\n")
    error = config.add_position(ConfigError("robustness.to: foo is no key", "advice", ("robustness", "to", 1)))
    assert error.message.endswith("mine.yaml:2:28: robustness.to: foo is no key")
    elsewhere = ConfigError("of no key")
    assert config.add_position(elsewhere) is elsewhere
    assert config.add_position(ConfigError("of a default", "", ("design", "over"))).message == "of a default"


@pytest.mark.parametrize(
    ("name", "terrain"), [("kneed", "plane"), ("parts", "plane"), ("round-feet", "after-mid-swing")]
)
def test_suggested_contact_block_is_scaled_by_mass_and_can_be_loaded(loaded: Loaded, name: str, terrain: str) -> None:
    without = loaded(f"extends: {name}\ncontact: null\n").config
    contact = loaded(f"extends: {name}\n{contact_to_add(without.walker)}\n").config.contact
    built_in = load(Path(name)).config.contact
    assert contact is not None
    assert built_in is not None
    assert contact.terrain == terrain
    assert (contact.stiffness, contact.damping) == pytest.approx((built_in.stiffness, built_in.damping), rel=5e-3)


def test_start_of_the_paper_raises_no_warning(loaded: Loaded) -> None:
    assert loaded("start: [-0.2022, 0.1674, -0.60, -0.84]\n").warnings == ()


def test_resolving_a_start_twice_changes_nothing(loaded: Loaded) -> None:
    once = loaded("slope_deg: 3\nstart: [null, 0.3, 0, 0]\n").config
    state = list(once.start)
    assert loaded(f"slope_rad: {once.slope_rad!r}\nstart: {state}\n").config.start == once.start


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "walker:\n  leg_lenght_m: 1\n",
            r"mine.yaml:2:3: walker.leg_lenght_m: unknown key \(1\); did you mean walker.leg_length_m\?",
        ),
        ("slope: 3\n", r"1:1: slope: unknown key \(3\); did you mean slope_deg\?"),
        (
            "extends: paper\ncontact:\n  static_friction: 0.5\n",
            r"mine.yaml:3:20: contact.static_friction: contact.dynamic_friction is still 0.7 \(from built-in "
            r"paper.yaml\) and must not exceed static_friction, 0.5; allowed: set contact.dynamic_friction too",
        ),
        (
            "extends: paper\ncontact:\n  stiction_velocity: 2000\n",
            r"mine.yaml:3:22: contact.stiction_velocity: contact.friction_velocity is still 1000 \(from built-in",
        ),
        ("slope_rads: 0.1\n", r"did you mean slope_rad\?"),
        ("leg_mass: 3\n", r"did you mean walker.leg_mass_kg\?"),
        ("contact.stiffness: 1e6\n", r"did you mean contact: \{stiffness: …\}\?"),
        ("Strides: 3\n", r"did you mean strides\?"),
        ("extend: paper\n", r"did you mean extends\?"),
        (
            "gravity_m_s2: strong\n",
            r"1:15: gravity_m_s2: 'strong' is not a number; allowed: number, from 1e-6 to 10000 \(m/s\^2\)",
        ),
        ("gravity_m_s2: '9.81'\n", r"'9.81' is not a number"),
        ("gravity_m_s2: no\n", r"'no' is not a number"),
        ("gravity_m_s2: true\n", r"true is not a number"),
        ("gravity_m_s2:\n", r"nothing is not a number"),
        ("gravity_m_s2: -9.81\n", r"-9.81 is out of bounds"),
        ("gravity_m_s2: .inf\n", r".inf is not finite"),
        ("slope_rad: .nan\n", r".nan is not finite"),
        ("strides: 5.0\n", r"5.0 is not an integer; allowed: integer, from 1 to 10000"),
        ("strides: 0\n", r"0 is out of bounds"),
        ("strides: 1e7\n", r"1e7 is not an integer"),
        ("name: ../../x\n", r"name: '../../x' is not valid"),
        ("name: /etc\n", r"is not valid"),
        ("name: ''\n", r"is not valid"),
        ("name: a@b\n", r"is not valid"),
        ("name: 7\n", r"7 is not text"),
        ("walker: 3\n", r"3 is not a block of keys"),
        ("contact: [1]\n", r"\[1\] is not a block of keys; allowed: a block of keys, or null"),
        ("start: [1, 2]\n", r"start: \[1, 2\] has too few values; allowed: fixed-point, four numbers"),
        ("start: [1, 2, 3, 4, 5]\n", r"has 5 values; this walker needs 4"),
        ("start: [1, 2, 3, x]\n", r"1:18: start: 'x' is not a number"),
        ("start: fixedpoint\n", r"did you mean fixed-point\?"),
        ("outputs: states\n", r"'states' is not a list"),
        ("outputs: [state]\n", r"1:11: outputs: 'state' is not allowed; did you mean states\?"),
        ("equations: as_printed\n", r"; did you mean as-printed\? Allowed: one of corrected, as-printed"),
        (
            "solver: {rigid: {method: dop835}}\n",
            r"; did you mean dop853\? Allowed: one of dop853, radau5, or a method of SciPy",
        ),
        ("solver: {contact: {method: radau}}\n", r"did you mean (radau5|scipy-radau)\?"),
        ("contact: {pad_pitch: -1}\n", r"-1 is out of bounds; allowed: rigid, own, or 1e-6 to 1e4 \(m\)"),
        ("contact: {friction_velocity: 100}\n", r"friction_velocity: 100 must exceed stiction_velocity, 100"),
        (
            "contact:\n  stiffness: 1e5\n  static_friction: 0.5\n",
            r"mine.yaml:3:20: contact.dynamic_friction: 0.7 \(its default\) must not exceed static_friction, 0.5",
        ),
        ("contact: {units: si, stiction_velocity: 100}\n", r"must be from 1e-07 to 10 m/s, with `units: si`"),
        ("slope_deg: 90\n", r"1:12: slope_deg: 90 is out of bounds; allowed: number, between -90 and 90"),
        ("slope_deg: steep\n", r"slope_deg: 'steep' is not a number"),
        (
            "slope_deg: 1\nslope_rad: 0.1\n",
            r"2:1: slope_rad: slope already set by slope_deg at mine.yaml:1:1",
        ),
        ("strides: 1\nstrides: 2\n", r"2:1: strides: duplicate key, first at mine.yaml:1:1"),
        ("", r"1:1: the file is empty"),
        ("# nothing\n", r"the file is empty"),
        ("- 1\n", r"1:1: the file holds a list"),
        ("just words\n", r"1:1: the file holds a single value"),
        ("1: 2\n", r"1: unknown key \(2\)"),
    ],
)
def test_bad_file_is_rejected_with_position_value_and_allowed_range(refused: Refused, text: str, expected: str) -> None:
    assert re.search(expected, refused(text))


def test_leg_with_its_mass_at_the_hip_is_rejected_as_massless(refused: Refused) -> None:
    message = refused("walker: {leg_length_m: 0.8, foot_to_mass_m: 0.8, leg_inertia_kg_m2: 0.1}\n")
    assert "1:45: walker.foot_to_mass_m: 0.8 equals leg_length_m, so b = 0" in message
    assert "the swing leg is massless" in message


def test_all_problems_are_reported_in_file_order(refused: Refused) -> None:
    lines = refused(
        "strides: 0\nwalker:\n  foo: 1\n  leg_mass_kg: x\nslope_deg: 95\ncontact: {damping: -1}\n"
    ).splitlines()
    assert [line.split(":")[1] for line in lines] == ["1", "3", "4", "5", "6"]


def test_long_list_of_problems_is_truncated(refused: Refused) -> None:
    lines = refused("".join(f"k{index}: 1\n" for index in range(1000))).splitlines()
    assert len(lines) == 21


def test_control_characters_of_a_file_do_not_reach_the_terminal(refused: Refused) -> None:
    assert "\x1b" not in refused('"a\\e[31m": 1\n')


def test_config_error_exits_3_and_suggests_a_command(write: Write) -> None:
    with pytest.raises(ConfigError) as caught:
        load(write("foo: 1\n"))
    assert caught.value.exit_code == 3
    assert "walkerlab schema" in caught.value.advice


def test_method_of_an_uninstalled_package_names_that_package(refused: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "find_spec", lambda name: None)
    message = refused("solver: {contact: {method: cvode-bdf}}\n")
    assert message.startswith("mine.yaml:1:")
    assert "solver.contact.method: 'cvode-bdf'" in message
    assert message.endswith("pip install scikit-sundae")


def test_changing_the_inherited_type_lists_keys_that_the_new_type_lacks(refused: Refused) -> None:
    message = refused("extends: paper\n", ["walker.type=kneed"])
    assert message.startswith("--set walker.type=kneed: walker.type: kneed has no leg_length_m, foot_to_mass_m, ")
    assert "(of type compass), given at built-in paper.yaml:" in message
    assert "`-c kneed`, in a file `extends: kneed`" in message
    assert len(message.splitlines()) == 1
    message = refused("extends: paper\nwalker:\n  type: straight-legs\n")
    assert message.startswith("mine.yaml:3:3: walker.type: straight-legs has no foot_to_mass_m (of type compass)")
    assert "`-c round-feet`" in message


def test_error_for_a_key_of_another_walker_type_lists_the_allowed_keys(refused: Refused) -> None:
    message = refused("walker: {type: kneed, leg_length_m: 1.0}\n")
    assert "1:23: walker.type is kneed, which has no leg_length_m (of type compass); allowed: type, thigh" in message
    message = refused("extends: paper\n", ["walker.thigh.length_m=0.4"])
    assert message.startswith("--set walker.thigh.length_m=0.4: walker.type is compass, which has no thigh (of type ")


def test_leg_length_that_contradicts_the_parts_is_rejected(refused: Refused) -> None:
    message = refused("extends: parts\n", ["walker.leg_length_m=1.2"])
    assert "--set walker.leg_length_m=1.2: walker.leg_length_m: 1.2 disagrees with the parts" in message
    assert "it is 1 m" in message
    arcs = [f"{{body: shank {leg}, centre_m: [0.02, -0.45], radius_m: 0.1}}" for leg in (1, 2)]
    assert "it is 1.05 m" in refused("extends: parts\n", [f"walker.feet=[{', '.join(arcs)}]"])
    own_frames = (BUILTIN_FOLDER / "parts.yaml").read_text().replace("centre_m: [0.0, -0.5]", "centre_m: [0.0, -0.4]")
    assert "5:17: walker.leg_length_m: 1.0 disagrees with" in refused(own_frames.split("\n", 2)[2])


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("slope_rad=1", "slope_rad is in radians, so this is 57.3 degrees; slope_deg takes degrees"),
        ("walker.leg_mass_kg=5000", "walker.leg_mass_kg is 5000 kg on legs of 1 m; masses are in kg, not in g"),
    ],
)
def test_value_that_may_be_in_another_unit_raises_a_warning(setting: str, said: str) -> None:
    assert load(sets=[setting]).warnings == (f"--set {setting}: {said}",)


def test_steep_slopes_and_heavy_walkers_raise_no_warning() -> None:
    assert load(sets=["slope_deg=45"]).warnings == ()
    large = ("walker.leg_length_m=10", "walker.foot_to_mass_m=5", "walker.leg_mass_kg=5000")
    assert load(sets=large).warnings == ()


def test_suspicious_masses_of_parts_raise_a_warning() -> None:
    (warning,) = load(sets=["walker.torso={mass_kg: 5000, above_hip_m: 0.3}"]).warnings
    assert "walker.torso.mass_kg is 5000 kg" in warning


def test_warning_points_to_the_line_of_an_inner_block(loaded: Loaded) -> None:
    (warning,) = loaded("extends: kneed\nwalker:\n  shank:\n    mass_kg: 5000\n").warnings
    assert "mine.yaml:4:5: walker.shank.mass_kg is 5000 kg" in warning


@pytest.mark.parametrize(
    ("line", "wrong", "said"),
    [
        ("body: shank 2, centre_m", "body: shnk 2, centre_m", "21:14: walker.feet.1.body: shnk 2 is not a body; did"),
        ("body: shank 2, centre_m", "body: shank 1, centre_m", "21:14: walker.feet.1.body: shank 1 does not belong to"),
        ("body: thigh 2, at_m", "body: thigh, at_m", "18:39: walker.particles.0.body: thigh is not a body"),
        ("legs: [[thigh 1,", "legs: [[thigh 3,", "22:11: walker.legs.0.0: thigh 3 is not a body"),
        ("parent: thigh 1,", "parent: tigh 1,", "15:30: walker.hinges.1.parent: tigh 1 is not a body"),
    ],
)
def test_part_on_a_missing_body_is_rejected_at_its_position(line: str, wrong: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    text = (BUILTIN_FOLDER / "parts.yaml").read_text()
    assert line in text
    file.write_text(text.replace(line, wrong, 1))
    with pytest.raises(ConfigError, match=re.escape(f"mine.yaml:{said}")):
        load(file)
