"""Tests of the stage `plot`: its files, its index, and the figures that it omits."""

from pathlib import Path

import pytest
from synthetic_methods import measured_methods
from synthetic_walks import both_models, rigid_alone

from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.store import artifact
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.figures import stage as plot

WITHOUT_CONTACT = [LeftOut(name, "the config has no contact block") for name in ("contact-sim", "compare")]


class Count:
    """Progress display that counts its calls."""

    def __init__(self):
        self.total, self.done = None, 0

    def start(self, label, total=None):
        self.total = total

    def advance(self, n=1):
        self.done += n

    def note(self, text):
        pass


def draw(folder, results, left_out=(), progress=None, early=None):
    return plot.run(restrict(Config(), PIPELINE["plot"].takes), results, progress or Count(), folder, left_out, early)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the folder and the content of a run of both models."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, draw(folder, both_models())


@pytest.fixture(scope="module")
def rigid_only(tmp_path_factory):
    """Return the same for a run without contact, in a folder that already had drawings."""
    folder = tmp_path_factory.mktemp("rigid")
    (folder / "figures").mkdir()
    for name in ("figure-06.svg", "figure-02.png", "figure-mine.svg"):
        (folder / "figures" / name).write_text("drawn before")
    progress = Count()
    return folder, draw(folder, rigid_alone(), WITHOUT_CONTACT, progress), progress


def papers_left_out(content):
    """Return the omitted figures, except those of accuracy, tune and maps, which have no result here."""
    elsewhere = ("it needs accuracy", "it needs tune", "it needs stability-maps")
    return [entry for entry in content.summary["left_out"] if entry["why"] not in elsewhere]


def names(folder):
    return sorted(path.name for path in folder.glob("figures/*"))


def test_every_figure_is_an_svg_and_a_png(whole):
    folder, content = whole
    drawn = [Path(entry["svg"]).stem for entry in content.summary["figures"]]
    assert names(folder) == sorted(f"{name}.{kind}" for name in drawn for kind in ("png", "svg"))
    assert [entry["number"] for entry in content.summary["figures"] if "number" in entry] == [2, 6, 7, 8, 9, 10]
    assert {"ground-forces", "energy-lost"} <= set(drawn)
    assert papers_left_out(content) == []


def test_index_lists_every_file_with_its_digest(whole):
    folder, content = whole
    assert sorted(artifact.indexed_files(content)) == [f"figures/{name}" for name in names(folder)]
    assert artifact.broken_file(folder, content) is None


def test_figures_drawn_early_are_final_and_not_redrawn(tmp_path):
    folder, content = tmp_path, draw(tmp_path, both_models())
    results = both_models() | measured_methods()
    written = {path: path.stat().st_mtime_ns for path in (folder / "figures").iterdir()}
    final = draw(folder, results, early=content)
    assert {path: path.stat().st_mtime_ns for path in written} == written
    assert artifact.broken_file(folder, content) is None
    entries = {entry["svg"]: entry for entry in final.summary["figures"]}
    assert len(entries) > len(content.summary["figures"])
    assert [entries[entry["svg"]] for entry in content.summary["figures"]] == content.summary["figures"]
    anew = draw(folder, results)
    assert artifact.indexed_files(anew) == artifact.indexed_files(final)


def test_each_figure_entry_has_its_texts_and_existing_files(whole):
    folder, content = whole
    for entry in content.summary["figures"]:
        assert set(entry) | {"number"} == {"number", "title", "svg", "png", "caption", "alt", "results"}
        assert entry["alt"].endswith(".")
        assert set(entry["results"]) <= {stage.name for stage in PIPELINE.stages}
        assert (folder / entry["svg"]).is_file()
        assert (folder / entry["png"]).is_file()


def test_figures_without_results_are_omitted_with_the_reason(rigid_only):
    _, content, _ = rigid_only
    assert [entry["number"] for entry in content.summary["figures"]] == [2, 7, 9, 10]
    why = "it needs {}: the config has no contact block"
    left_out = papers_left_out(content)
    assert {entry["why"] for entry in left_out} == {why.format("contact-sim"), why.format("compare")}
    for entry in (
        {"what": "figure 6", "why": why.format("contact-sim")},
        {"what": "figure 8", "why": why.format("compare")},
        {"what": "figure ground-forces", "why": why.format("contact-sim")},
        {"what": "figure energy-lost", "why": why.format("contact-sim")},
    ):
        assert entry in left_out


def test_only_figures_of_missing_results_are_removed(rigid_only):
    folder, _, _ = rigid_only
    assert "figure-06.svg" not in names(folder)
    assert (folder / "figures" / "figure-mine.svg").read_text() == "drawn before"
    assert (folder / "figures" / "figure-02.png").read_bytes().startswith(b"\x89PNG")


def test_progress_counts_figures(rigid_only):
    _, _, progress = rigid_only
    assert progress.done == progress.total == 4


def test_nothing_to_draw_is_not_a_failure(tmp_path):
    left_out = [LeftOut("fixedpoint", "no gait"), LeftOut("simulate", "it needs fixedpoint: no gait")]
    content = draw(tmp_path, {}, left_out)
    assert content.summary["figures"] == []
    assert names(tmp_path) == []
    of_walks = {f"figure {name}" for name in (2, 6, 7, 8, 9, 10, "ground-forces", "energy-lost")}
    assert {entry["what"] for entry in papers_left_out(content)} >= of_walks
