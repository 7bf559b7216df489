import json
import os
import re
import subprocess
import sys

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import walkerlab
from walkerlab.config.fields import block_of, words_of
from walkerlab.config.schema import Config
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.stage import Option, Stage
from walkerlab.pipeline.run.workers import ONE_THREAD
from walkerlab.pipeline.store.provenance import git_commit
from walkerlab.views.cli import main
from walkerlab.views.cli.main import program

HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "h5py",
    "matplotlib",
    "ruamel",
    "jinja2",
    "filelock",
    "rich",
    "walkerlab.config.schema",
)
OPTIONS = ("--config", "-c", "--set", "--runs", "--force", "--dry-run", "--json", "--quiet", "-q", "--verbose", "-v")

LOADED_BY = """
import sys
from walkerlab.views.cli.main import main
sys.argv = ["walkerlab", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert end.code == 0, end.code
print(*(name for name in %r if name in sys.modules), file=sys.stderr)
"""


@pytest.mark.parametrize("arguments", [["--help"], ["simulate", "--help"], ["status", "--help"], ["--version"]])
def test_help_loads_no_library(arguments):
    code = LOADED_BY % (HEAVY,)
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.split() == []
    assert done.stdout


def test_help_names_every_command(walker):
    done = walker("--help")
    commands = {line.split()[0] for line in done.stdout.split("Start:")[1].splitlines() if line.strip()}
    assert {*(stage.name for stage in PIPELINE.stages), "status", "show", "schema", "clean"} <= commands


def test_help_lists_every_command_once_in_five_groups(walker):
    lines = walker("--help").stdout.split("Options:")[1].splitlines()
    titles = [line.removesuffix(":") for line in lines if re.fullmatch(r"\w.*:", line)]
    assert titles == ["Start", "Walk", "Explore families of gaits", "Measure and compare", "Keep house"]
    assert titles == list(main.GROUPS)
    listed = [name for names in main.GROUPS.values() for name in names]
    assert sorted(listed) == sorted(get_command(main.program()).commands)
    shown = [line.split()[0] for line in lines if re.match(r"  [a-z]", line)]
    assert shown == listed


def test_help_begins_every_purpose_with_a_verb(walker):
    verbs = {command.help.split()[0] for command in get_command(main.program()).commands.values()}
    assert "Walk" not in verbs
    assert all(verb.istitle() and verb not in ("The", "A", "Whether") for verb in verbs)


def test_help_states_the_purpose_of_each_command_in_full(walker):
    words = " ".join(walker("--help").stdout.split("Start:")[1].split())
    assert all(stage.purpose in words for stage in PIPELINE.stages)
    assert "..." not in words


@pytest.mark.parametrize("stage", PIPELINE.stages, ids=lambda stage: stage.name)
def test_every_stage_has_the_common_options_and_only_walking_stages_have_strides(walker, stage):
    words = set(walker(stage.name, "--help").stdout.replace(",", " ").split())
    if stage.adds_command:
        assert {"--config", "--set", "--json", "--quiet", "--verbose"} <= words
        return
    assert set(OPTIONS) <= words
    assert "--jobs" in words
    assert ("--strides" in words) == (stage.name in ("simulate", "contact-sim", "report"))
    assert ("--open" in words) == (stage.name == "report")


OF_STAGES = [(stage.name, option) for stage in PIPELINE.stages for option in stage.options if not option.runs]
BLOCKS_OF_OTHERS = {("compare", "recording"), ("identify", "plan"), ("plan", "identify")}


@pytest.mark.parametrize(("stage", "option"), OF_STAGES, ids=lambda entry: getattr(entry, "flag", entry))
def test_stage_option_sets_a_key_and_offers_its_allowed_values(stage, option):
    block, _, name = option.key.rpartition(".")
    fields = block_of(Config.model_fields[block]).model_fields if block else Config.model_fields
    names = {field.alias or key: field for key, field in fields.items()}
    assert block in ("", stage) or (stage, block) in BLOCKS_OF_OTHERS
    assert not set(option.needs) - {other.flag for other in PIPELINE[stage].options}
    if "|" in option.metavar:
        assert set(option.metavar.split("|")) - {"DEG"} == set(words_of(names[name].annotation))
    else:
        assert name in names


def test_version_is_followed_by_the_commit(walker):
    commit = git_commit()
    known = f" (commit {commit})" if commit else ""
    assert walker("--version").stdout == f"walkerlab {walkerlab.__version__}{known}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["dance"],
        ["simulate", "--quick"],
        ["simulate", "--strides", "many"],
        ["fixedpoint", "--strides", "3"],
        ["show"],
        ["show", "dance"],
    ],
)
def test_wrong_usage_exits_2_without_traceback(walker, arguments):
    done = walker(*arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert not list(walker.folder.iterdir())


def test_schema_prints_every_key_as_text_and_as_json(walker):
    assert "walker.leg_length_m" in walker("schema").stdout
    assert "slope_rad" in json.loads(walker("schema", "--json").stdout)["properties"]


@pytest.mark.parametrize("arguments", [["--set", "slope=1"], ["--set", "slope_rad=.nan"], ["--config", "nowhere.yaml"]])
def test_bad_config_exits_3_before_anything_runs(walker, arguments):
    done = walker("simulate", *arguments)
    assert done.returncode == 3
    assert done.stderr.startswith("error: ")
    assert done.stdout == ""
    assert not list(walker.folder.iterdir())


def completed(walker, typed):
    """Return what bash offers for the last word of a command line."""
    asked = {"COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1), "_WALKERLAB_COMPLETE": "complete_bash"}
    code = "import sys; from walkerlab.views.cli.main import main; sys.argv = ['walkerlab']; main()"
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, cwd=walker.folder, env={**walker.environment, **asked}, capture_output=True, text=True
    )
    return done.stdout.split()


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("walkerlab simulate --set slope_d", ["slope_deg="]),
        ("walkerlab simulate --set walker.thigh.le", ["walker.thigh.length_m="]),
        ("walkerlab continuation --over walker.hip_", ["walker.hip_mass_kg"]),
        ("walkerlab simulate -c simp", ["simplest", "simple.yaml"]),
        ("walkerlab simulate --stri", ["--strides"]),
    ],
)
def test_shell_completes_keys_configs_and_options(walker, typed, offered):
    (walker.folder / "simple.yaml").write_text("extends: paper\n", encoding="utf-8")
    assert completed(walker, typed) == offered


@pytest.mark.parametrize("typed", ["--slope_deg", "--slope-deg", "--hip_mass_kg"])
def test_config_key_typed_as_an_option_suggests_the_set_option(typed):
    done = CliRunner().invoke(program(), ["fixedpoint", typed, "3"])
    assert done.exit_code == 2
    assert f"{typed.lstrip('-').replace('-', '_')}=VALUE" in done.output
    assert "--set" in done.output


def test_ambiguous_key_name_prefers_the_block_of_the_command():
    done = CliRunner().invoke(program(), ["basin", "--model", "contact"])
    assert "--set basin.model=VALUE" in done.output


def test_unknown_option_gets_the_usual_message():
    done = CliRunner().invoke(program(), ["fixedpoint", "--colour", "3"])
    assert done.exit_code == 2
    assert "--set" not in done.output


def test_flag_may_contain_a_hyphen():
    option = Option("--from-step", "strides", "N", "First step.", "int")
    graph = Graph(Stage("settle", "stages.settle", "Settle.", None, options=(option,)))
    done = CliRunner().invoke(program(graph), ["settle", "--help"])
    assert done.exit_code == 0
    assert "--from-step" in done.output


def test_stage_that_an_option_redirects_to_has_every_option_that_requires_the_redirect():
    redirects = [(stage, option) for stage in PIPELINE.stages for option in stage.options if option.runs]
    assert [(stage.name, option.flag, option.runs) for stage, option in redirects] == [("identify", "--plan", "plan")]
    for stage, option in redirects:
        needing = {other.flag for other in stage.options if option.flag in other.needs}
        assert needing <= {other.flag for other in PIPELINE[option.runs].options}


def test_linear_algebra_uses_one_thread_by_default():
    show = """
import os
from walkerlab.views.cli import main
main.program = lambda: lambda: None
main.main()
print(os.environ["OPENBLAS_NUM_THREADS"])
"""
    for own, threads in ({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2"):
        rest = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
        done = subprocess.run([sys.executable, "-c", show], env=rest | own, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == threads
