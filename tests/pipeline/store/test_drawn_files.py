import pytest

from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.runs import RunFolder, files_of, remove


@pytest.fixture
def folder(tmp_path):
    made = RunFolder(tmp_path, "paper")
    made.figures.mkdir(parents=True)
    (made.figures / "figure-02.svg").write_text("<svg/>")
    (made.figures / "own.svg").write_text("drawn by a plot of mine")
    (made.path / "notes.txt").write_text("mine")
    return made


def drawn(folder):
    return Content({artifact.FILES_GROUP: artifact.index_files(folder.path, [folder.figures / "figure-02.svg"])})


def test_unchanged_drawn_files_are_not_reported_as_broken(folder):
    assert artifact.broken_file(folder.path, drawn(folder)) is None
    assert artifact.broken_file(folder.path, Content()) is None


def test_altered_or_missing_file_is_named(folder):
    content = drawn(folder)
    (folder.figures / "figure-02.svg").write_text("<svg>other</svg>")
    assert artifact.broken_file(folder.path, content) == "figures/figure-02.svg was altered"
    (folder.figures / "figure-02.svg").unlink()
    assert artifact.broken_file(folder.path, content) == "figures/figure-02.svg is missing"


def test_only_files_of_the_run_can_be_listed(folder, tmp_path):
    (tmp_path / "elsewhere").touch()
    with pytest.raises(ValueError):
        artifact.index_files(folder.path, [tmp_path / "elsewhere"])


def test_clean_removes_only_generated_files(folder, identity, origin):
    artifact.write(folder.artifact("plot"), drawn(folder), identity, origin)
    folder.artifact("simulate").write_bytes(b"damaged")
    (folder.path / ".simulate.h5.12345678.tmp").touch()
    remove(folder, files_of(folder, ["simulate", "plot"]))
    left = sorted(path.name for path in folder.path.rglob("*"))
    assert left == ["figures", "notes.txt", "own.svg"]


def test_clean_ignores_listed_files_outside_the_run_folder(folder, identity, origin, tmp_path):
    (tmp_path / "precious").write_text("not of this run")
    forged = artifact.index_files(tmp_path, [tmp_path / "precious"])
    forged["file"].setflags(write=True)
    forged["file"][0] = "../precious"
    artifact.write(folder.artifact("plot"), Content({artifact.FILES_GROUP: forged}), identity, origin)
    assert files_of(folder, ["plot"]) == [folder.figures / "figure-02.svg", folder.artifact("plot")]


def test_leftovers_are_searched_only_in_run_folders(tmp_path):
    strange = tmp_path / "photos" / ".notes.12345678.tmp"
    strange.parent.mkdir()
    strange.touch()
    unfinished = tmp_path / "figures" / ".figure-02.svg.12345678.tmp"
    unfinished.parent.mkdir()
    unfinished.touch()
    assert files_of(RunFolder.open_folder(tmp_path), ()) == [unfinished]
