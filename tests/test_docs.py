"""Check README and docs: links have targets, commands are accepted, and tables and outputs are those of the program."""

import base64
import json
import os
import re
import runpy
import shlex
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from browser import Browser, executable
from forks import forks
from typer.main import get_command
from typer.testing import CliRunner

import walkerlab
from walkerlab.config import reads
from walkerlab.config.loader import load
from walkerlab.config.schema import Contact
from walkerlab.physics.ground.friction import FRICTION_LAWS, friction_coefficient
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.stage import Stage, results_of
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.scene.parts import missing_members
from walkerlab.views.cli.main import program
from walkerlab.views.figures import illustration

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
MAKER = runpy.run_path(str(ROOT / "scripts" / "refresh_docs.py"))
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
ANCHOR = re.compile(r"\]\(([^)#\s]*)#([^)\s]+)\)")
COMMAND = re.compile(r"\bwalkerlab (?:[a-z-]+)(?: [^`&|\n#]*)?")
ANSWER_AT_ONCE = ("status", "show", "schema")
ONLY_READ = ("init", "open", "rerun", "export", "animate", "draw", "check")
BUG, USAGE, BAD_CONFIG = 1, 2, 3


@cache
def whole_program():
    """Return the command line as a click command."""
    return get_command(program())


def text_of(path):
    return path.read_text(encoding="utf-8")


def code_in(path):
    """Yield each text in backticks or in a fenced block."""
    text = text_of(path)
    yield from re.findall(r"^ *```[a-z]*\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)
    yield from re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text)


@cache
def commands():
    """Return the commands of stages that are not run as examples."""
    names = {stage.name for stage in PIPELINE.stages if not stage.adds_command} | {*ANSWER_AT_ONCE, "clean", "sweep"}
    code = [code for path in DOCUMENTS for code in code_in(path) if not code.startswith("$ ")]
    found = {command.strip() for each in code for command in COMMAND.findall(each)}
    return sorted(command for command in found if shlex.split(command)[1] in names)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_existing_files(path):
    relative = [link for link in LINK.findall(text_of(path)) if "://" not in link]
    assert [link for link in relative if not (path.parent / link).exists()] == []


def anchors(page):
    """Return the anchors that GitHub makes for the headings of a page."""
    text = re.sub(r"^```.*?^```$", "", text_of(page), flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_existing_headings(path):
    links = [(file, anchor) for file, anchor in ANCHOR.findall(text_of(path)) if "://" not in file]
    assert [link for link in links if link[1] not in anchors(path.parent / link[0] if link[0] else path)] == []


def code_to_add():
    """Return the Python examples of docs/adding.md: figure, stage (type, module, registry entry) and law."""
    return re.findall(r"^```python\n(.*?)^```$", text_of(ROOT / "docs" / "adding.md"), re.DOTALL | re.MULTILINE)


def test_example_figure_of_the_docs_is_drawn(tmp_path, monkeypatch):
    words = re.search(r"^```jinja\n(.*?)^```$", text_of(ROOT / "docs" / "adding.md"), re.DOTALL | re.MULTILINE)[1]
    (tmp_path / "slip-per-step.j2").write_text(words, encoding="utf-8")
    monkeypatch.setattr(illustration, "WORDS", replace(illustration.WORDS, folder=tmp_path))
    names = {}
    exec(next(code for code in code_to_add() if "FIGURE =" in code), names)
    figure = names["FIGURE"]
    assert "contact-sim" in figure.why_left_out({}, {})
    steps = Group({"slip_m": Variable(np.array([5e-4, 6e-4]), ("step",), "m", "slip")})
    walk = SimpleNamespace(groups={"steps": steps})
    assert figure.why_left_out({"contact-sim": walk}, {}) is None
    drawing = figure.render({"contact-sim": walk})
    assert b"slip (mm)" in drawing.svg
    assert drawing.caption.endswith("contact model, at most 0.6 mm.")


def test_example_stage_of_the_docs_runs(monkeypatch):
    type_it_takes, module, entry = (code for code in code_to_add() if "peed" in code)
    exec(type_it_takes, vars(reads), names := {})
    monkeypatch.setattr(reads, "SpeedConfig", names["SpeedConfig"], raising=False)
    exec(module, names)
    stage = eval(entry, {"Stage": Stage, "results_of": results_of, "reads": reads})
    assert stage.reads(load().config) == ("gravity_m_s2",)
    steps = {name: Variable(np.array([0.5]), ("step",), "1", name) for name in ("length_m", "period_s")}
    found = names["run"](SimpleNamespace(gravity_m_s2=10.0), {"simulate": Content({"steps": Group(steps)}, {})}, None)
    assert found.summary == {"speed_m_s": 1.0, "froude": 0.1}


def test_example_friction_law_of_the_docs_is_complete_and_its_derivative_correct(monkeypatch):
    monkeypatch.setattr(friction_coefficient, "_bodies", dict(friction_coefficient._bodies))
    example = runpy.run_path(str(ROOT / "docs" / "examples" / "extension" / "tanh_friction" / "law.py"))["Tanh"]
    assert missing_members(example, FRICTION_LAWS) == []
    law, h = example.from_contact(Contact(units="si")), 1e-6
    assert law == pytest.approx((0.7, 0.1, 0.3, 0.3))
    low, high = (friction_coefficient(law, 0.05 + side * h)[0] for side in (-1, 1))
    assert friction_coefficient(law, 0.05)[1] == pytest.approx((high - low) / (2 * h), rel=1e-8)
    assert low < 0.0
    assert -friction_coefficient(law, law.rising_until)[0] == pytest.approx(law.largest, rel=0.005)
    assert friction_coefficient(law.scale_creep(0.5), 0.02) == pytest.approx(
        (friction_coefficient(law, 0.04)[0], 2.0 * friction_coefficient(law, 0.04)[1])
    )


@pytest.mark.parametrize("page", ["architecture", "pipeline", "adding"])
def test_files_and_names_in_the_developer_pages_exist(page):
    text = re.sub(r"^```.*?^```$", "", text_of(ROOT / "docs" / f"{page}.md"), flags=re.DOTALL | re.MULTILINE)
    source = "".join(text_of(file) for file in (ROOT / "walkerlab").rglob("*.py"))
    said = set(re.findall(r"`([a-z_/]+\.py|[a-z_]+/[a-z_/]+)`", text)) - {
        "walkerlab/views/figures/slip.py",
        "walkerlab/pipeline/stages/speed.py",
    }
    assert [name for name in said if not any((base / name).exists() for base in places())] == []
    names = set(re.findall(r"`([A-Z]\w+|[A-Z_]{4,})`", text)) - {"SpeedConfig"}
    assert [name for name in names if not re.search(rf"\b{name}\b", source)] == []


def places():
    """Return the folders that may contain a file named in a document."""
    package = ROOT / "walkerlab"
    return (ROOT, package, *(path for path in package.iterdir() if path.is_dir()))


@cache
def named_runs():
    """Return the names of runs in the commands of the documents."""
    return {name for command in commands() for name in re.findall(r"--name (\S+)", command)}


@pytest.mark.parametrize("command", commands())
def test_documented_command_is_accepted(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stands_for = {"STAGE": "fixedpoint", "FILE": "my.yaml"}
    words = [stands_for.get(word, word) for word in shlex.split(command)[1:]]
    runs = [word for word in words if word.startswith("runs/") or (word in named_runs() and "--name" not in words)]
    if runs:
        # Use the paper's config in place of a run that does not exist.
        words = [word for word in words if word not in runs and word != "-c"]
    for name in (word for word in words if word.endswith(".yaml") and not word.startswith("configs/")):
        (tmp_path / name).write_text("extends: paper\n", encoding="utf-8")
    if words[0] == "show":
        (tmp_path / "runs" / "paper").mkdir(parents=True)  # A folder is enough for a run without results.
    dry = [] if words[0] in ANSWER_AT_ONCE else ["--dry-run"]
    done = CliRunner().invoke(program(), [*words, *dry])
    assert done.exit_code not in (BUG, USAGE, BAD_CONFIG), done.output


@cache
def commands_around_runs():
    found = {command.strip() for path in DOCUMENTS for code in code_in(path) for command in COMMAND.findall(code)}
    return sorted(command for command in found if shlex.split(command)[1] in ONLY_READ)


@pytest.mark.parametrize("command", commands_around_runs())
def test_commands_for_runs_in_the_docs_use_only_existing_options(command):
    _, name, *words = shlex.split(command)
    asked = whole_program().commands[name]
    if words:
        asked.make_context(name, words)
    else:
        # These commands need no word: they act on the paper's run, or a sentence only names them.
        assert name in ("open", "init", "check")


def test_every_command_is_in_the_docs():
    said = " ".join(code for path in DOCUMENTS for code in code_in(path))
    assert [name for name in whole_program().commands if not re.search(rf"walkerlab {name}\b", said)] == []


@pytest.mark.parametrize(
    "text", re.findall(r"^```yaml\n(.*?)^```$", text_of(ROOT / "README.md"), re.DOTALL | re.MULTILINE)
)
def test_documented_config_is_accepted(text, tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text(text, encoding="utf-8")
    assert load(path, ()).config


def run(command, exit_code_before):
    """Run a command as in a shell. A plain command of the package runs in a fork that has already loaded the
    libraries.
    """
    name, *words = shlex.split(command)
    if name != "walkerlab" or {"|", ";", "&&", ">", "<"} & {*words}:
        return MAKER["run_in_shell"](command, exit_code_before)
    paths = {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    done = forks().run("walkerlab", words, Path.cwd(), {**os.environ, **MAKER["TERMINAL"], **paths})
    return MAKER["answer_of"](done), done.returncode


@pytest.mark.parametrize("path", MAKER["with_examples"](), ids=lambda path: path.name)
def test_documented_output_is_the_actual_output(path, tmp_path):
    assert "\n".join(MAKER["differences"](path, tmp_path, run=run)) == ""


def test_example_with_different_output_is_detected(tmp_path):
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
def test_generated_tables_are_up_to_date(name, results):
    text = text_of(ROOT / name)
    assert MAKER["refreshed"](text, results) == text, "run: python scripts/refresh_docs.py"


def test_every_generated_part_has_a_generator_and_is_used_once():
    placed = [part for name in MAKER["DOCUMENTS"] for _, part, _, _ in MAKER["PART"].findall(text_of(ROOT / name))]
    assert sorted(placed) == sorted(MAKER["PARTS"])


def test_index_links_every_page_and_the_readme_links_the_index():
    index = text_of(ROOT / "docs" / "index.md")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert sorted(page for page in pages if f"({page})" not in index) == []
    assert "(docs/index.md)" in text_of(ROOT / "README.md")


def test_api_reference_has_every_name_of_the_package():
    listed = re.search(r"members: \[(.*)\]", text_of(ROOT / "docs" / "api.md"))[1].split(", ")
    assert sorted(listed) == sorted(set(walkerlab.__all__) - {"Config", "ConfigError"})


def test_api_reference_shows_arguments_as_a_list_and_examples_as_code():
    pytest.importorskip("griffe")
    shown = runpy.run_path(str(ROOT / "scripts" / "api_docstrings.py"))["as_markdown"]
    assert shown("Walk.\n\nslope_deg  downhill,\n           deg\na, b       both\n\n>>> 1 + 1\n2\n\nEnd.") == (
        "Walk.\n\n- `slope_deg`: downhill,\n           deg\n- `a, b`: both\n\n```pycon\n>>> 1 + 1\n2\n```\n\nEnd."
    )


def test_every_picture_of_the_docs_is_registered_and_on_a_page():
    drawn = {path.name for path in (ROOT / "docs" / "images").iterdir() if path.suffix in (".png", ".gif")}
    assert set(MAKER["stale_pictures"].__globals__["PICTURES"]) == drawn
    pages = "".join(text_of(path) for path in DOCUMENTS)
    assert [name for name in sorted(drawn) if f"images/{name})" not in pages] == []


@pytest.mark.parametrize(
    "page", ["index", "tutorial", "howto", "identify", "walkers", "explore", "exchange", "recordings"]
)
def test_page_for_newcomers_has_a_picture(page):
    assert re.search(r"^!\[[^]]+\]\(images/", text_of(ROOT / "docs" / f"{page}.md"), re.MULTILINE)


def test_pictures_in_the_docs_have_the_labels_that_the_code_draws(tmp_path):
    assert list(MAKER["stale_pictures"](tmp_path)) == [], "run: python scripts/refresh_docs.py --pictures"


def test_picture_is_out_of_date_when_a_label_changes(tmp_path, monkeypatch):
    pictures = MAKER["stale_pictures"].__globals__
    shutil.copytree(ROOT / "docs" / "images", tmp_path / "images")
    monkeypatch.setitem(pictures, "IMAGES", tmp_path / "images")
    words = tmp_path / "images" / "figure-06.words"
    words.write_text(words.read_text().replace("height (m)", "height in m"))
    monkeypatch.setitem(pictures, "PICTURES", {"figure-06.png": pictures["PICTURES"]["figure-06.png"]})
    assert list(MAKER["stale_pictures"](tmp_path / "runs")) == [tmp_path / "images" / "figure-06.png"]


def test_stored_labels_of_a_picture_contain_no_numbers():
    words_of = MAKER["stale_pictures"].__globals__["words_of"]
    svg = "<text x='1'>slope (rad)</text><text>0.25</text><text><tspan>step 12</tspan></text>"
    assert words_of(svg) == "slope (rad)\nstep #\n"


def test_links_that_leave_the_site_become_text_or_source_links():
    keep_text = runpy.run_path(str(ROOT / "scripts" / "mkdocs_hooks.py"))["on_page_markdown"]
    assert keep_text("See [`tree.py`](../walkerlab/tree.py) and [theory](theory.md).", page=None) == (
        "See `tree.py` and [theory](theory.md)."
    )
    for path in (ROOT / "docs").glob("*.md"):
        outside = [link for link in LINK.findall(text_of(path)) if link.startswith("../")]
        assert [link for link in outside if not link.startswith(("../walkerlab/", "../tests/", "../configs/"))] == []


def test_start_page_links_every_page_of_the_site():
    pages = re.findall(r": ([\w-]+\.md)$", text_of(ROOT / "scripts" / "mkdocs.yml"), re.MULTILINE)
    assert "identify.md" in pages
    assert [page for page in pages if f"({page})" not in text_of(ROOT / "docs" / "index.md")] == ["index.md"]


def test_gallery_page_contains_animated_gaits(tmp_path):
    make = runpy.run_path(str(ROOT / "scripts" / "make_gallery.py"))["sweep_page"]
    make.__globals__.update(SLOPES="3:20:2", HIPS=[10])
    page = make(tmp_path)
    gait, none = (row[0] for row in json.loads(re.search(r'id="gaits">(.*?)</script>', page)[1]))
    assert gait["text"].startswith("Steps of 0.5354 m in 0.7343 s")
    floats = np.frombuffer(base64.b64decode(gait["floats"]), "<f4").reshape(len(gait["meta"]["channels"]), -1)
    time = floats[gait["meta"]["channels"].index("t")]
    assert time[-1] == pytest.approx(2 * 0.7343, abs=1e-3)
    assert "meta" not in none
    assert "no gait" in none["text"]
    (tmp_path / "page.html").write_text(page)
    if (chromium := executable()) is not None:
        browser = Browser(chromium)
        browser.open(tmp_path / "page.html")
        browser.until("Number(document.querySelector('[data-player]').dataset.time) > 0.1")
        assert browser.complaints() == []
        browser.close()


def test_paper_draft_cites_every_reference_and_marks_its_blanks():
    folder = ROOT / "docs" / "joss"
    text, references = text_of(folder / "paper.md"), text_of(folder / "paper.bib")
    assert set(re.findall(r"@(\w+)", text.partition("# Summary")[2])) == set(
        re.findall(r"^@\w+\{(\w+)", references, re.MULTILINE)
    )
    for part in ("Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"):
        assert f"\n# {part}\n" in text
    assert text.count("[BLANK") >= 5


def test_pipeline_diagram_contains_every_stage():
    drawing = re.search(r"```mermaid\n(.*?)```", text_of(ROOT / "docs" / "pipeline.md"), re.DOTALL)[1]
    assert [stage.name for stage in PIPELINE.stages if not re.search(rf"\b{stage.name}\b", drawing)] == []
