"""README and docs say what is so: links lead somewhere, commands are accepted, tables are what the tool gives."""

import re
import runpy
import shlex
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import walkerlab
from walkerlab.cli.main import program
from walkerlab.config.loader import load
from walkerlab.stages.graph import PIPELINE

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
MAKER = runpy.run_path(str(ROOT / "scripts" / "refresh_docs.py"))
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
COMMAND = re.compile(r"\bwalkerlab (?:[a-z-]+)(?: [^`&|\n#]*)?")
ANSWER_AT_ONCE = ("status", "show", "schema")
ONLY_READ = ("init", "open", "rerun", "export", "animate")
BUG, USAGE, BAD_CONFIG = 1, 2, 3


def text_of(path):
    return path.read_text(encoding="utf-8")


def code_in(path):
    """What stands in backticks or in a fenced block."""
    text = text_of(path)
    yield from re.findall(r"^ *```[a-z]*\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)
    yield from re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text)


def commands():
    """Those of stages that are not run as examples."""
    names = {*(stage.name for stage in PIPELINE.stages), *ANSWER_AT_ONCE, "clean", "sweep"}
    code = [code for path in DOCUMENTS for code in code_in(path) if not code.startswith("$ ")]
    found = {command.strip() for each in code for command in COMMAND.findall(each)}
    return sorted(command for command in found if shlex.split(command)[1] in names)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files_that_are_there(path):
    relative = [link for link in LINK.findall(text_of(path)) if "://" not in link]
    assert [link for link in relative if not (path.parent / link).exists()] == []


def called_in(path):
    """Names that a document calls in code: `name(...)`."""
    return {name for code in code_in(path) for name in re.findall(r"\b([A-Za-z_]\w+)\(\w", code)}


@pytest.mark.parametrize("path", [ROOT / "docs" / "pipeline.md"], ids=lambda path: path.name)
def test_functions_that_a_document_calls_are_defined(path):
    source = "".join(text_of(file) for file in (ROOT / "walkerlab").rglob("*.py"))
    defined = set(re.findall(r"^\s*(?:def|class) (\w+)", source, re.MULTILINE)) | {"sha256"}
    assert called_in(path)
    assert called_in(path) <= defined


@pytest.mark.parametrize("command", commands())
def test_a_documented_command_is_accepted(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stands_for = {"STAGE": "fixedpoint", "FILE": "my.yaml"}
    words = [stands_for.get(word, word) for word in shlex.split(command)[1:]]
    if any(word.startswith("runs/") for word in words):
        # the paper's own config instead of a run that is not there
        words = [word for word in words if not word.startswith("runs/") and word != "-c"]
    for name in (word for word in words if word.endswith(".yaml") and not word.startswith("configs/")):
        (tmp_path / name).write_text("extends: paper\n", encoding="utf-8")
    if words[0] == "show":
        (tmp_path / "runs" / "paper").mkdir(parents=True)  # a run, without results
    dry = [] if words[0] in ANSWER_AT_ONCE else ["--dry-run"]
    done = CliRunner().invoke(program(), [*words, *dry])
    assert done.exit_code not in (BUG, USAGE, BAD_CONFIG), done.output


def commands_around_runs():
    found = {command.strip() for path in DOCUMENTS for code in code_in(path) for command in COMMAND.findall(code)}
    return sorted(command for command in found if shlex.split(command)[1] in ONLY_READ)


@pytest.mark.parametrize("command", commands_around_runs())
def test_a_documented_command_around_runs_has_the_options_that_it_is_given(command):
    _, name, *words = shlex.split(command)
    asked = get_command(program()).commands[name]
    if words:
        asked.make_context(name, words)
    else:
        assert name == "open"  # the paper's run


def test_every_command_is_in_the_docs():
    said = " ".join(code for path in DOCUMENTS for code in code_in(path))
    assert [name for name in get_command(program()).commands if not re.search(rf"walkerlab {name}\b", said)] == []


@pytest.mark.parametrize(
    "text", re.findall(r"^```yaml\n(.*?)^```$", text_of(ROOT / "README.md"), re.DOTALL | re.MULTILINE)
)
def test_a_documented_config_is_accepted(text, tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text(text, encoding="utf-8")
    assert load(path, ()).config


@pytest.mark.parametrize("path", MAKER["with_examples"](), ids=lambda path: path.name)
def test_examples_print_what_documents_show(path, tmp_path):
    assert "\n".join(MAKER["differences"](path, tmp_path)) == ""


def test_an_example_that_prints_otherwise_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "```yaml\n# a.yaml\nname: a\n```\n```console\n$ cat a.yaml\n...\nname: b\n$ ls -- no-such; exit 3\n...\n"
        "$ echo $?\n3\n```\n```pycon\n>>> 1 + 1\n3\n```\n",
        encoding="utf-8",
    )
    config, python = MAKER["differences"](page, tmp_path)
    assert "name: a" in config
    assert "Got:\n    2" in python


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    return MAKER["Results"](tmp_path_factory.mktemp("runs"))


@pytest.mark.parametrize("name", MAKER["DOCUMENTS"])
def test_tables_are_what_the_tool_gives(name, results):
    text = text_of(ROOT / name)
    assert MAKER["refreshed"](text, results) == text, "run: python scripts/refresh_docs.py"


def test_every_part_has_a_maker_and_a_place():
    placed = [part for name in MAKER["DOCUMENTS"] for _, part, _, _ in MAKER["PART"].findall(text_of(ROOT / name))]
    assert sorted(placed) == sorted(MAKER["PARTS"])


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.name)
def test_the_readme_leads_to_every_page(page):
    assert f"(docs/{page.name})" in text_of(ROOT / "README.md")


def test_the_api_reference_has_every_name_of_the_package():
    listed = re.search(r"members: \[(.*)\]", text_of(ROOT / "docs" / "api.md"))[1].split(", ")
    assert sorted(walkerlab.__all__) == sorted(set(listed) - {"Result", "Run"})


def test_the_api_reference_shows_arguments_as_a_list_and_examples_as_code():
    pytest.importorskip("griffe")
    shown = runpy.run_path(str(ROOT / "scripts" / "api_docstrings.py"))["as_markdown"]
    assert shown("Walk.\n\nslope_deg  downhill,\n           deg\na, b       both\n\n>>> 1 + 1\n2\n\nEnd.") == (
        "Walk.\n\n- `slope_deg`: downhill,\n           deg\n- `a, b`: both\n\n```pycon\n>>> 1 + 1\n2\n```\n\nEnd."
    )


def test_the_pipeline_page_draws_every_stage():
    drawing = re.search(r"```mermaid\n(.*?)```", text_of(ROOT / "docs" / "pipeline.md"), re.DOTALL)[1]
    assert [stage.name for stage in PIPELINE.stages if not re.search(rf"\b{stage.name}\b", drawing)] == []
