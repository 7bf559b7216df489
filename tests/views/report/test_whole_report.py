"""Tests of a short but complete report of real results: sections and synthetic results use the keys that stages
store.
"""

import functools

import pytest
import synthetic_results as made
from html_page import Page
from latex import compile_tables

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.benchmarks import accuracy, references
from walkerlab.evidence.benchmarks.trials import ContactTrial, RigidTrial
from walkerlab.evidence.verification import known_problems, stability
from walkerlab.evidence.verification.catalogue import package_cases
from walkerlab.physics.orbits import rigid_limit
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.views.cli import exports
from walkerlab.views.cli.console import Console
from walkerlab.views.cli.exports import Target, export_from, page_tables
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.registry import SECTIONS
from walkerlab.views.report.tex import as_tex

SETS = ("strides=1", "tune.cells=2")
JUDGED = ("paper", "rigid-no-hip-mass")
STAGES = PIPELINE["report"].inputs(load().config)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Write the report of the paper's config for two steps, four cells, three rigidities, two cases and two methods."""
    with pytest.MonkeyPatch.context() as patch:
        cases = tuple(case for case in package_cases() if case.name in JUDGED)
        assert len(cases) == len(JUDGED)
        patch.setattr(stability, "all_cases", lambda own: cases)
        patch.setattr(known_problems, "PROBLEMS", known_problems.PROBLEMS[:1])
        for trial in (RigidTrial, ContactTrial):
            patch.setattr(trial, "methods", property(lambda self: ("dop853", "radau5")))
        patch.setattr(accuracy, "OWN_LADDER", (1e-3, 1e-6))
        patch.setattr(accuracy, "MAX_REPEATS", 1)
        patch.setattr(references, "TIGHTEST_CONTACT", {"dop853": 1e-8, "radau5": 1e-9})
        few = {name: (3, *setting) for name, (_, *setting) in rigid_limit.SERIES_SETTINGS.items()}
        patch.setattr(rigid_limit, "SERIES_SETTINGS", few)
        patch.setattr(rigid_limit, "TIMED_WALKS", 1)
        loaded = load(None, SETS)
        folder = RunFolder(tmp_path_factory.mktemp("runs"), loaded.run_name)
        return loaded.config, folder, execute(loaded.config, "report", folder)


@pytest.fixture(scope="module")
def results(run):
    """Return the results from which the report was made."""
    config, folder, _ = run
    return Results(config, {name: artifact.read(folder.artifact(name)) for name in STAGES})


def test_every_stage_ran_and_the_page_is_there(run):
    _, folder, report = run
    assert report.no_answer is None
    assert {done.stage.name for done in report.steps if done.action == "run"} == {
        stage.name for stage in PIPELINE.needed_for("report", load().config)
    }
    page = Page((folder.path / report.summary["html"]).read_text(encoding="utf-8"))
    assert len(report.summary["tables"]) > 10
    assert len(report.summary["figures"]) > 8
    assert not {"None", "nan", "inf"} & set(page.text.split())


def test_every_table_can_be_exported_by_its_caption(run, tmp_path, monkeypatch):
    _, folder, report = run
    # Each export would make all pages again from the same results.
    monkeypatch.setattr(exports, "page_tables", functools.cache(page_tables))
    heads = set()
    for number, caption in enumerate(report.summary["tables"]):
        texts = []
        for kind in ("csv", "tex"):
            file = tmp_path / f"{number}.{kind}"
            texts.append(export_from(folder, caption, Target(None, file), "", Console(quiet=True)).read_text())
        heads.add(texts[0].splitlines()[0])
        assert "\n\\begin{table}\n\\centering\n\\caption{" + caption[:5] in texts[1]
        assert not set("θωφμλ₁₂⁻−×") & set(texts[1])
    assert len(heads) > 10
    with pytest.raises(ConfigError) as refused:
        export_from(folder, "no-such-thing", Target(None, None), "", Console(quiet=True))
    assert "the-contact-models-walk" in refused.value.advice


def test_exported_values_are_in_the_unit_of_their_header(run):
    tables = page_tables(run[1])
    cells = [cell for table in tables.values() for rows in table.groups.values() for row in rows for cell in row]
    numbers = [cell for cell in cells if isinstance(cell.datum, float) and cell.text.isascii()]
    assert len(numbers) > 50
    for cell in numbers:
        assert cell.datum == pytest.approx(float(cell.text), rel=0.06), cell


ON_DEMAND = (
    "families",
    "basin",
    "engines.section",
    "check.section",
    "robustness",
    "identification",
)  # sections of stages that run only by their own commands


def test_report_excludes_stages_that_run_only_on_demand(results):
    makers = [make for make in SECTIONS if make.__module__.endswith(ON_DEMAND)]
    assert len(makers) == len(ON_DEMAND) + 1, "the section of measurements to make is in identification, too"
    assert [make(results) for make in makers] == [None] * len(makers)


# keys of drawings and omissions, and of a recorded walk, which does not exist here
NOT_IN_RESULTS = ("figures", "left_out", "recorded")
OF_EVERY_REPORT = [
    make for make in SECTIONS if not make.__module__.endswith(ON_DEMAND) and make.__name__ not in NOT_IN_RESULTS
]


@pytest.mark.parametrize(
    "make", OF_EVERY_REPORT, ids=lambda make: f"{make.__module__.rpartition('.')[2]}.{make.__name__}"
)
def test_sections_of_real_results_are_not_empty(results, run, make):
    section = make(results)
    assert section is not None
    assert section.blocks


@pytest.mark.parametrize("stage", made.EVERYTHING)
def test_synthetic_results_have_only_keys_of_real_ones(results, stage):
    by_hand, real = made.EVERYTHING[stage](), results.stored[stage]
    assert set(by_hand.summary) <= set(real.summary)
    for name, group in by_hand.groups.items():
        assert set(group.variables) <= set(real.groups[name].variables)


def test_every_table_fits_the_text_block_of_an_article(run, tmp_path):
    texts = [as_tex(content).decode() for content in page_tables(run[1]).values()]
    assert compile_tables(texts, "twocolumn", tmp_path) == []
