"""Check README, and that CI runs its commands in empty environments."""

import re
import tomllib
from pathlib import Path

import jinja2
from ruamel.yaml import YAML

import walkerlab

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
CHECK = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
FENCED = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
BLOCKS = [block for language, block in FENCED if not language]


def test_readme_shows_fixedpoint_as_the_first_command_after_the_install():
    after = README.partition("```\npip install .\n```\n")[2]
    assert after.index("$ walkerlab fixedpoint") == after.index("$ walkerlab ")
    assert after.index("$ walkerlab fixedpoint") < after.index("```\nwalkerlab")


def test_readme_says_how_to_install_repeat_the_study_and_run_the_tests():
    assert [block.strip() for block in BLOCKS] == [
        "pip install .",
        "walkerlab report\nwalkerlab open",
        "pip install '.[test]' && pytest",
    ]


def test_readme_fits_on_a_few_screens():
    assert len(README.split()) <= 700


def test_ci_runs_the_report_command_in_an_empty_folder():
    parts = dict(re.findall(r'^ +part \d+ "README: ([^"]+)" (.*)$', CHECK, re.MULTILINE))
    assert parts["install"] == BLOCKS[0].strip()
    assert parts["walkerlab report"] == BLOCKS[1].splitlines()[0]
    installing = CHECK[: CHECK.index('"README: install"')].splitlines()
    assert installing[-2].strip() == 'enter_new_environment "$1" "$scratch/for-report"'
    before = CHECK[: CHECK.index('"README: walkerlab report"')]
    between = before[before.rindex('. "$scratch/for-report/bin/activate"') :]
    assert 'mkdir "$scratch/empty"' in between
    assert 'cd "$scratch/empty"' in between


def test_ci_runs_the_test_command_verbatim():
    assert f'readme_test="{BLOCKS[2].strip()}"' in CHECK
    assert 'part 2700 "README: test" bash -euc "$readme_test"' in CHECK


def test_ci_names_no_package_index():
    assert not re.search(r"https?://|index-url|--extra-index|--find-links", CHECK)


def test_version_numbers_agree():
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert pyproject["project"]["dynamic"] == ["version"]
    assert pyproject["tool"]["hatch"]["version"]["path"] == "walkerlab/__init__.py"
    assert f"\nversion: {walkerlab.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    heading = "Unreleased" if ".dev" in walkerlab.__version__ else walkerlab.__version__
    assert f"## {heading}\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_conda_recipe_requires_the_same_packages():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (ROOT / "docs" / "conda" / "meta.yaml").read_text(encoding="utf-8")
    recipe = YAML(typ="safe").load(jinja2.Template(text).render(PYTHON="python"))
    asked = [re.sub(r"(?=[<>=])", " ", one, count=1) for one in project["dependencies"]]
    assert recipe["requirements"]["run"] == [
        f"python {project['requires-python']}",
        *(one.replace("matplotlib ", "matplotlib-base ") for one in asked),
    ]
    assert recipe["build"]["entry_points"] == [f"{name} = {what}" for name, what in project["scripts"].items()]
    assert recipe["source"]["path"].endswith(f"dist/walkerlab-{walkerlab.__version__}.tar.gz")
    assert (recipe["package"]["version"], "://" in text) == (walkerlab.__version__, False)


def test_minimum_python_version_is_the_documented_one():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11"
    assert "Python 3.11 or newer" in README


def test_pictures_are_small():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", README)
    limits = {picture: 1_500_000 if picture.endswith(".gif") else 300_000 for picture in pictures}
    assert len(pictures) >= 3
    assert [picture for picture, limit in limits.items() if (ROOT / picture).stat().st_size >= limit] == []
