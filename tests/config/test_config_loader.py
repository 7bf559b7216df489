"""From a file, `extends`, `--set` and `--strides` to one config, or to a refusal that says where and why."""

import math
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.schema import Config, Contact
from walkerlab.errors import ConfigError

Write = Callable[..., Path]
Loaded = Callable[..., LoadedConfig]
Refused = Callable[..., str]
BOMB = b"a: &a [x,x]\nb: &b [*a,*a]\nc: [*b,*b]\n"


def test_without_a_path_it_is_the_paper() -> None:
    paper = load()
    assert paper.config == Config(contact=Contact())
    assert (paper.run_name, paper.warnings, paper.source) == ("paper", (), "built-in paper.yaml")


def test_a_built_in_config_can_be_named() -> None:
    assert load(Path("rigid-only")).config.contact is None


def test_a_file_is_preferred_to_a_built_in_config_of_that_name(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("slope_deg: 2\n", "paper")
    monkeypatch.chdir(tmp_path)
    assert load(Path("paper")).config.slope_rad == math.radians(2)


def test_a_config_without_a_name_is_named_after_its_file(loaded: Loaded) -> None:
    assert loaded("slope_deg: 2\n").run_name == "mine"


def test_a_file_name_that_is_no_safe_run_name_asks_for_one(write: Write) -> None:
    with pytest.raises(ConfigError, match="name: 'my config' is not safe"):
        load(write("slope_deg: 2\n", "my config.yaml"))


def test_loading_is_a_matter_of_a_quarter_second() -> None:
    """The best of several, since the machine may be busy; what is not needed (numpy, numba) is not imported."""
    script = "import sys; from walkerlab.config.loader import load; load(); sys.exit('numpy' in sys.modules)"
    times = []
    for _ in range(5):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", script], check=True)
        times.append(time.perf_counter() - start)
    bare = time.perf_counter()
    subprocess.run(
        [sys.executable, "-c", "from pydantic import BaseModel\nclass A(BaseModel):\n    x: int = 1"], check=True
    )
    assert min(times) < max(0.25, 3 * (time.perf_counter() - bare))


class TestRefusals:
    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            (
                "walker:\n  leg_lenght_m: 1\n",
                r"mine.yaml:2:3: walker.leg_lenght_m: unknown key \(1\); did you mean walker.leg_length_m\?",
            ),
            ("slope: 3\n", r"1:1: slope: unknown key \(3\); did you mean slope_rad\?"),
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
            ("name: ../../x\n", r"name: '../../x' is not safe as the name of a folder"),
            ("name: /etc\n", r"is not safe"),
            ("name: ''\n", r"is not safe"),
            ("name: a@b\n", r"is not safe"),
            ("name: 7\n", r"7 is not a text"),
            ("walker: 3\n", r"3 is not a block of keys"),
            ("contact: [1]\n", r"\[1\] is not a block of keys; allowed: a block of keys, or null"),
            ("start: [1, 2]\n", r"start: \[1, 2\] has too few values; allowed: fixed-point, or four numbers"),
            ("start: [1, 2, 3, 4, 5]\n", r"too many values"),
            ("start: [1, 2, 3, x]\n", r"1:18: start: 'x' is not a number"),
            ("start: fixedpoint\n", r"did you mean fixed-point\?"),
            ("outputs: states\n", r"'states' is not a list"),
            ("outputs: [state]\n", r"1:11: outputs: 'state' is not allowed; did you mean states\?"),
            ("equations: as_printed\n", r"did you mean as-printed\?; allowed: one of corrected, as-printed"),
            (
                "solver: {rigid: {method: dop835}}\n",
                r"did you mean dop853\?; allowed: one of dop853, radau5, scipy-rk45",
            ),
            ("solver: {contact: {method: radau}}\n", r"did you mean (radau5|scipy-radau)\?"),
            ("contact: {pad_pitch: -1}\n", r"-1 is out of bounds; allowed: rigid, own, or 1e-6 to 1e4 \(m\)"),
            ("contact: {friction_velocity: 100}\n", r"friction_velocity: 100 must exceed stiction_velocity, 100"),
            (
                "contact: {static_friction: 0.5}\n",
                r"dynamic_friction: 0.7 \(its default\) must not exceed static_friction, 0.5",
            ),
            ("contact: {units: si, stiction_velocity: 100}\n", r"must be from 1e-07 to 10 m/s, as `units: si` has it"),
            ("slope_deg: 90\n", r"1:12: slope_deg: 90 is out of bounds; allowed: number, between -90 and 90"),
            ("slope_deg: steep\n", r"slope_deg: 'steep' is not a number"),
            (
                "slope_deg: 1\nslope_rad: 0.1\n",
                r"2:1: slope_rad: the slope is given already, as slope_deg at mine.yaml:1:1",
            ),
            ("strides: 1\nstrides: 2\n", r"2:1: strides: given a second time, first at mine.yaml:1:1"),
            ("", r"1:1: the file is empty"),
            ("# nothing\n", r"the file is empty"),
            ("- 1\n", r"1:1: the file holds a list"),
            ("just words\n", r"1:1: the file holds a single value"),
            ("1: 2\n", r"1: unknown key \(2\)"),
        ],
    )
    def test_a_bad_file_is_refused_with_place_value_and_what_is_allowed(
        self, refused: Refused, text: str, expected: str
    ) -> None:
        assert re.search(expected, refused(text))

    def test_a_leg_with_its_mass_at_the_hip_is_refused_for_what_it_is(self, refused: Refused) -> None:
        message = refused("walker: {leg_length_m: 0.8, foot_to_mass_m: 0.8, leg_inertia_kg_m2: 0.1}\n")
        assert "1:45: walker.foot_to_mass_m: 0.8 equals leg_length_m, so b = 0" in message
        assert "the swing leg is massless" in message

    def test_all_problems_are_reported_together_in_the_order_of_the_file(self, refused: Refused) -> None:
        lines = refused(
            "strides: 0\nwalker:\n  foo: 1\n  leg_mass_kg: x\nslope_deg: 95\ncontact: {damping: -1}\n"
        ).splitlines()
        assert [line.split(":")[1] for line in lines] == ["1", "3", "4", "5", "6"]

    def test_a_flood_of_problems_is_cut(self, refused: Refused) -> None:
        lines = refused("".join(f"k{index}: 1\n" for index in range(1000))).splitlines()
        assert len(lines) == 21

    def test_what_a_file_says_cannot_steer_the_terminal(self, refused: Refused) -> None:
        assert "\x1b" not in refused('"a\\e[31m": 1\n')

    def test_the_exit_code_is_3_and_the_advice_names_a_command(self, write: Write) -> None:
        with pytest.raises(ConfigError) as caught:
            load(write("foo: 1\n"))
        assert caught.value.exit_code == 3
        assert "walkerlab schema" in caught.value.advice


class TestFiles:
    def test_a_missing_file_is_named_with_what_was_perhaps_meant(self, write: Write, tmp_path: Path) -> None:
        write("name: mine\n", "experiment.yaml")
        with pytest.raises(
            ConfigError, match=r"there is no config .*experimnt\.yaml; did you mean .*experiment\.yaml\?"
        ):
            load(tmp_path / "experimnt.yaml")

    def test_a_folder_is_no_config(self, tmp_path: Path) -> None:
        with pytest.raises(ConfigError, match="is a folder"):
            load(tmp_path)

    @pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs /dev/zero")
    def test_an_endless_device_is_no_config(self) -> None:
        with pytest.raises(ConfigError, match="not a regular file"):
            load(Path("/dev/zero"))

    def test_a_pipe_is_not_waited_for(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "pipe.yaml")
        with pytest.raises(ConfigError, match="not a regular file"):
            load(tmp_path / "pipe.yaml")

    @pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs a file that cannot be read even by root")
    def test_an_unreadable_file_is_refused_in_words(self) -> None:
        with pytest.raises(ConfigError, match="cannot be read"):
            load(Path("/proc/self/mem"))

    @pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
    def test_a_file_without_permission_is_refused_in_words(self, write: Write) -> None:
        path = write("name: mine\n")
        path.chmod(0)
        with pytest.raises(ConfigError, match="permission denied"):
            load(path)

    @pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "\udcff.yaml", "no/such/folder/x.yaml", ""])
    def test_an_impossible_path_is_refused_in_words(self, name: str) -> None:
        with pytest.raises(ConfigError):
            load(Path(name))

    def test_a_link_to_itself_is_refused_in_words(self, tmp_path: Path) -> None:
        (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
        with pytest.raises(ConfigError, match="cannot be read"):
            load(tmp_path / "loop.yaml")

    @pytest.mark.parametrize(
        "data",
        [
            b"\x89HDF\r\n\x1a\n\x00\x00",
            b"\xff\xfea\x00:\x00",
            b"\x7fELF\x02\x01",
            b"a: \xc3\x28\n",
            BOMB,
            b"\x00" * 100,
        ],
    )
    def test_junk_is_refused_with_its_place(self, tmp_path: Path, data: bytes) -> None:
        path = tmp_path / "junk.yaml"
        path.write_bytes(data)
        with pytest.raises(ConfigError, match=r"junk\.yaml:\d+:\d+: "):
            load(path)

    def test_a_byte_that_is_not_utf8_is_placed_by_characters(self, tmp_path: Path) -> None:
        path = tmp_path / "junk.yaml"
        path.write_bytes("a: 1\nä: ".encode() + b"\xff\n")
        with pytest.raises(ConfigError, match=r"junk\.yaml:2:4: byte 0xff is not UTF-8"):
            load(path)

    def test_a_huge_file_is_refused_without_reading_it(self, tmp_path: Path) -> None:
        path = tmp_path / "huge.yaml"
        with path.open("wb") as file:
            file.truncate(1 << 40)
        start = time.perf_counter()
        with pytest.raises(ConfigError, match="not a config"):
            load(path)
        assert time.perf_counter() - start < 1.0

    def test_a_byte_order_mark_does_no_harm(self, tmp_path: Path) -> None:
        path = tmp_path / "marked.yaml"
        path.write_bytes(b"\xef\xbb\xbfslope_deg: 2\r\nstrides: 3\r\n")
        assert load(path).config.strides == 3

    @settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
    @given(st.binary(max_size=120))
    def test_any_bytes_are_a_config_or_refused(self, tmp_path: Path, data: bytes) -> None:
        path = tmp_path / "any.yaml"
        path.write_bytes(data)
        with pytest.raises(ConfigError):
            load(path)

    @settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
    @given(st.data())
    def test_a_damaged_paper_config_is_a_config_or_refused(self, tmp_path: Path, data: st.DataObject) -> None:
        text = (Path(__file__).parents[2] / "configs" / "paper.yaml").read_text(encoding="utf-8")
        at = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 40))
        junk = data.draw(st.text(alphabet=" \n\t[]{}:,#&*!|>'\"%@`-?0e.ax", max_size=12))
        path = tmp_path / "damaged.yaml"
        path.write_text(text[:at] + junk + text[at + length :], encoding="utf-8")
        with suppress(ConfigError):
            assert isinstance(load(path).config, Config)


class TestExtends:
    def test_a_file_inherits_and_blocks_are_merged(self, write: Write) -> None:
        write("extends: paper\nname: base\nstrides: 7\nwalker: {hip_mass_kg: 3}\n", "base.yaml")
        config = load(write("extends: base.yaml\nwalker: {leg_mass_kg: 2}\ncontact: {damping: 50}\n")).config
        assert (config.walker.hip_mass_kg, config.walker.leg_mass_kg, config.strides) == (3, 2, 7)
        assert config.contact is not None
        assert (config.contact.damping, config.contact.stiffness) == (50, 1e5)

    def test_the_name_is_not_inherited_so_that_runs_do_not_mix(self, loaded: Loaded) -> None:
        assert loaded("extends: paper\n").run_name == "mine"

    @pytest.mark.parametrize("slope", ["slope_deg: 3", "slope_rad: 0.05235987755982989"])
    def test_a_slope_displaces_the_inherited_one_in_either_unit(self, write: Write, slope: str) -> None:
        write("slope_deg: 1\n", "base.yaml")
        config = load(write(f"extends: base.yaml\n{slope}\n")).config
        assert config.slope_rad == pytest.approx(math.radians(3), rel=1e-15)

    def test_null_leaves_an_inherited_block_out(self, loaded: Loaded) -> None:
        assert loaded("extends: paper\ncontact: null\n").config.contact is None

    def test_a_list_is_replaced_whole(self, loaded: Loaded) -> None:
        assert loaded("extends: paper\noutputs: [forces]\n").config.outputs == ("forces",)

    def test_a_problem_in_an_inherited_file_is_placed_there(self, write: Write) -> None:
        write("strides: none\n", "base.yaml")
        with pytest.raises(ConfigError, match=r"base\.yaml:1:10: strides: 'none' is not an integer"):
            load(write("extends: base.yaml\n"))

    def test_a_circle_is_refused(self, write: Write) -> None:
        write("extends: mine.yaml\n", "other.yaml")
        with pytest.raises(ConfigError, match=r"other\.yaml:1:10: extends: .*mine\.yaml extends itself"):
            load(write("extends: other.yaml\n"))

    def test_a_missing_parent_is_placed_where_it_is_asked_for(self, refused: Refused) -> None:
        assert re.match(r"mine.yaml:2:10: there is no config .*nope\.yaml", refused("strides: 3\nextends: nope.yaml\n"))

    @pytest.mark.parametrize("parent", ["[paper]", "3", "''", "{a: 1}"])
    def test_a_parent_is_the_name_of_a_config(self, refused: Refused, parent: str) -> None:
        assert "extends: is not the name of a config" in refused(f"extends: {parent}\n")

    def test_a_long_chain_ends(self, write: Write) -> None:
        for index in range(20):
            write(f"extends: c{index + 1}.yaml\n", f"c{index}.yaml")
        with pytest.raises(ConfigError, match="files deep"):
            load(write("extends: c0.yaml\n"))


class TestSet:
    def test_a_value_is_yaml_typed_by_the_schema(self) -> None:
        config = load(
            None, ["contact.stiffness=1e6", "outputs=[forces]", "walker.hip_mass_kg=0", "equations=as-printed"]
        ).config
        assert config.contact is not None
        assert (config.contact.stiffness, config.outputs) == (1e6, ("forces",))
        assert (config.walker.hip_mass_kg, config.equations) == (0.0, "as-printed")

    def test_a_later_setting_wins(self) -> None:
        assert load(None, ["strides=3", "strides=4"]).config.strides == 4
        assert load(None, ["slope_rad=0.1", "slope_deg=3"]).config.slope_rad == math.radians(3)
        assert load(None, ["slope_deg=3", "slope_rad=0.1"]).config.slope_rad == 0.1

    def test_a_block_is_replaced_whole(self) -> None:
        contact = load(None, ["contact.damping=50", "contact={stiffness: 2e5}"]).config.contact
        assert contact == Contact(stiffness=2e5)

    def test_a_block_can_be_left_out_and_brought_in(self) -> None:
        assert load(None, ["contact=null"]).config.contact is None
        assert load(Path("rigid-only"), ["contact.damping=50"]).config.contact == Contact(damping=50)

    def test_strides_of_the_command_line_are_over_everything(self) -> None:
        assert load(None, ["strides=3"], strides=2).config.strides == 2

    @pytest.mark.parametrize(
        ("setting", "expected"),
        [
            ("contact.stifness=1e6", r"--set contact\.stifness=1e6:1:1: .* did you mean contact\.stiffness\?"),
            ("contact.damping=fast", r":1:17: contact\.damping: 'fast' is not a number"),
            ("strides=", r"strides: nothing is not an integer"),
            ("name=../../x", r"is not safe"),
            ("extends=paper", r"extends: belongs in a file"),
            ("strides", r"is not of the form KEY=VALUE"),
            ("=3", r"is not of the form KEY=VALUE"),
            ("a..b=3", r"is not of the form KEY=VALUE"),
            ("contact.units.x=3", r"contact\.units is a value, not a block"),
            ("start=[1, 2", r"not YAML"),
            ("start=" + "[" * 5000, r"nested deeper"),
            (".".join("a" * 3000) + "=1", r"nested deeper"),
            ("walker=&a [*a]", r"anchor"),
            ("strides=\udcff", r"\\udcff cannot be in a config"),
        ],
    )
    def test_a_bad_setting_is_refused_with_its_place(self, refused: Refused, setting: str, expected: str) -> None:
        assert re.search(expected, refused("contact: {units: si}\n", sets=[setting]))

    def test_bad_strides_are_refused(self) -> None:
        with pytest.raises(ConfigError, match="--strides 0:1:1: strides: 0 is out of bounds"):
            load(strides=0)

    @given(st.text(max_size=40))
    def test_any_setting_is_taken_or_refused(self, text: str) -> None:
        with suppress(ConfigError):
            assert isinstance(load(None, [text]).config, Config)


class TestStart:
    def test_theta_1_is_replaced_so_that_both_feet_stand_on_the_slope(self, loaded: Loaded) -> None:
        result = loaded("slope_deg: 2\nstart: [0.5, 0.17, -0.6, -0.8]\n")
        assert result.config.start == (pytest.approx(-2 * math.radians(2) - 0.17, abs=1e-15), 0.17, -0.6, -0.8)
        assert len(result.warnings) == 1
        assert re.search(r"mine\.yaml:2:8: start: theta_1 moved from 0\.5 to -0\.2398", result.warnings[0])

    def test_the_papers_own_start_stands_on_its_slope_and_nothing_is_said(self, loaded: Loaded) -> None:
        assert loaded("start: [-0.2022, 0.1674, -0.60, -0.84]\n").warnings == ()

    def test_a_resolved_start_resolves_to_itself(self, loaded: Loaded) -> None:
        once = loaded("slope_deg: 3\nstart: [0, 0.3, 0, 0]\n").config
        state = list(once.start)
        assert loaded(f"slope_rad: {once.slope_rad!r}\nstart: {state}\n").config.start == once.start
