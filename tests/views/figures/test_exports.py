"""Tests of exported figures, tables, trajectories and films."""

import csv
import io
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from late_imports import import_late
from PIL import Image
from synthetic_families import families
from synthetic_methods import everything
from synthetic_walks import both_models

from walkerlab.api import open_run
from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.artifact import read, write
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.provenance import begin
from walkerlab.pipeline.store.runs import RunFolder, claim
from walkerlab.views.cli.console import Console
from walkerlab.views.cli.exports import Film, Target, export_from, gif, walk_in, write_film
from walkerlab.views.figures import illustration
from walkerlab.views.figures import stage as plot
from walkerlab.views.figures.stage import FIGURES
from walkerlab.views.figures.style import FIGURE_WIDTH
from walkerlab.views.report.tex import escape_tex

xarray = import_late("xarray")

QUIET = Console(quiet=True)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "paper"
    folder.mkdir()
    for name, result in both_models().items():
        extra = {"table3": {"t_left": {"unit": "s", "corrected": 0.7}}} if name == "compare" else {}
        content = Content(result.groups, {**result.summary, **extra})
        write(folder / f"{name}.h5", content, result.identity, begin(load().config, {}))
    # Without it, all results would be read to find the config.
    claim(RunFolder.open_folder(folder), load().config)
    return folder


@pytest.fixture
def run(original, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return RunFolder.open_folder(shutil.copytree(original, tmp_path / "runs" / "paper"))


@pytest.mark.parametrize(
    ("kind", "start"),
    [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG"), ("eps", b"%!PS-Adobe"), ("tiff", b"II")],
)
def test_figure_is_exported_in_every_format(run, kind, start):
    path = export_from(run, "figure-09", Target(kind, None, width=516.0), "", QUIET)
    assert path.name == f"paper-figure-09.{kind}"
    assert path.read_bytes().startswith(start)


READERS_OF_RESULTS = {"figure-08", "figure-09", "figure-10", "figure-13", "accuracy-rigid", "stability-step"}
"""Figures of every stage, and figures that draw whichever results exist."""


def test_exported_figure_equals_that_of_the_page(run, monkeypatch):
    monkeypatch.setattr(illustration, "POINT", 1.0)
    monkeypatch.setattr(plot, "FIGURES", [figure for figure in FIGURES if figure.name in READERS_OF_RESULTS])
    results = {**everything(), **families()}
    for name, result in results.items():
        write(run.artifact(name), Content(result.groups, result.summary), result.identity, begin(load().config, {}))
    drawn = plot.run(restrict(Config(), PIPELINE["plot"].takes), results, Silent(), run.path).summary["figures"]
    assert {Path(entry["svg"]).stem for entry in drawn} == READERS_OF_RESULTS
    for name in READERS_OF_RESULTS:
        path = export_from(run, name, Target("svg", None, width=FIGURE_WIDTH), "", QUIET)
        assert path.read_bytes() == (run.path / "figures" / f"{name}.svg").read_bytes(), name


def test_figure_of_outdated_results_warns(run, capsys):
    export_from(run, "figure-09", Target("svg", None, width=516.0), "", Console())
    assert "outdated results, which are drawn anyway: compare, contact-sim and simulate;" in capsys.readouterr().err


def test_figure_has_the_requested_width(run, tmp_path):
    for points in (252.0, 300.0):
        file = Target("png", tmp_path / f"{points}.png", width=points)
        with Image.open(export_from(run, "figure-09", file, "", QUIET)) as image:
            assert image.size[0] == pytest.approx(points / 72.0 * 300.0, abs=1.0)


@pytest.mark.parametrize("kind", ["png", "tiff"])
def test_image_has_the_requested_resolution(run, kind):
    with Image.open(export_from(run, "figure-09", Target(kind, None, dpi=600), "", QUIET)) as image:
        assert image.size[0] == pytest.approx(3.5 * 600.0, abs=1.0)
        assert image.info["dpi"] == pytest.approx((600.0, 600.0), abs=0.1)


def test_fonts_of_a_pdf_are_embedded_as_truetype(run):
    data = export_from(run, "figure-09", Target("pdf", None), "", QUIET).read_bytes()
    assert b"/Type3" not in data.replace(b" ", b"")
    assert b"/FontFile2" in data.replace(b" ", b"")


def test_export_format_follows_the_file_name_and_must_not_contradict_it(run, tmp_path):
    assert export_from(run, "trajectory", Target(None, None), "simulate", QUIET).name == (
        "paper-simulate-trajectory.csv"
    )
    for target in (Target("svg", tmp_path / "mine"), Target(None, tmp_path / "mine.svg")):
        path = export_from(run, "figure-09", target, "", QUIET)
        assert path == target.output
        assert path.read_bytes().startswith(b"<?xml")
    with pytest.raises(ConfigError, match="contradicts the ending"):
        export_from(run, "figure-09", Target("pdf", tmp_path / "mine.svg"), "", QUIET)
    film = write_film(run, Target("gif", None), Film("simulate", 1, 5, 1.0), QUIET)
    assert film.name == "paper-simulate.gif"


def test_nothing_is_overwritten_silently(run, capsys):
    target = Target("csv", Path("walk.csv"))
    for model, told in (("simulate", ""), ("simulate", ""), ("contact-sim", "walk.csv existed and was replaced.")):
        export_from(run, "trajectory", target, model, Console())
        assert told in capsys.readouterr().err


def test_exported_csv_trajectory_equals_the_stored_one(run):
    path = export_from(run, "trajectory", Target("csv", None), "simulate", QUIET)
    with path.open() as file:
        head, *rows = csv.reader(file)
    stored = both_models()["simulate"]["trajectory"]
    assert head[0] == "time (s)"
    assert np.array([float(row[0]) for row in rows]).tolist() == stored["time"].tolist()
    column = head.index("angle 1 (rad)")
    assert [float(row[column]) for row in rows] == stored["angle"][:, 0].tolist()


def test_netcdf_trajectory_opens_without_a_group(run):
    path = export_from(run, "trajectory", Target("nc", None), "contact-sim", QUIET)
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["angle"].dims == ("time", "leg")
        assert dataset["time"].attrs["units"] == "s"
        assert dataset.attrs["title"] == "walkerlab contact-sim"


def test_latex_table_escapes_special_characters(run):
    text = export_from(run, "table-3", Target("tex", None), "", QUIET).read_text()
    assert r"left step period, $t_\mathrm{left}$ (s) & 0.70000 \\" in text
    assert escape_tex("x_p, dtheta_1") == r"$x_p$, $\dot{\theta}_1$"
    assert escape_tex("θ̇₁ (rad/s)") == r"$\dot{\theta}_{1}$ (rad/s)"
    assert escape_tex("end_time_s") == r"end\_time\_s"
    assert escape_tex("50 %") == r"50 \%"
    assert escape_tex("m/s^2, 10^-4") == "m/s$^{2}$, 10$^{-4}$"


@pytest.mark.parametrize("name", ["9", "09", "figure-9", "fig 9"])
def test_figure_can_be_named_by_its_number(run, name):
    assert export_from(run, name, Target("svg", None), "", QUIET).name == "paper-figure-09.svg"


def test_unknown_export_lists_what_the_run_has(run):
    with pytest.raises(ConfigError) as refused:
        export_from(run, "figur", Target("pdf", None), "", QUIET)
    assert "figure-09" in refused.value.advice
    assert refused.value.advice.endswith("\n  table-3\n  omitted-results\n  steps\n  trajectory")
    assert "figure-13" not in refused.value.advice


def test_unknown_export_suggests_a_similar_name(run):
    with pytest.raises(ConfigError, match=r"no item figure-03\.$"):
        export_from(run, "figure-3", Target("pdf", None), "", QUIET)


def test_figure_without_results_names_the_stage_that_makes_them(run):
    for name, command in (("figure-13", "continuation"), ("stability-step", "stability --full")):
        with pytest.raises(StaleError) as refused:
            export_from(run, name, Target("pdf", None), "", QUIET)
        assert refused.value.advice == f"Run `walkerlab {command} -c {run.quoted_path}` first."


def test_rigid_walk_is_the_default_without_a_contact_walk(run):
    assert walk_in(run) == "contact-sim"
    run.artifact("contact-sim").unlink()
    assert walk_in(run) == "simulate"


@pytest.mark.parametrize(
    ("what", "kind", "error", "said"),
    [
        ("tabl", "tex", ConfigError, "this run has no item tabl. Did you mean table"),
        ("table-1", "tex", ConfigError, "that table is about the paper's walker"),
        ("figure-07", "csv", ConfigError, "cannot be written as csv"),
        ("figure-11", "pdf", StaleError, "cannot be drawn"),
    ],
)
def test_impossible_export_is_explained(run, what, kind, error, said):
    with pytest.raises(error, match=said):
        export_from(run, what, Target(kind, None), "", QUIET)


def test_number_of_film_frames_follows_from_duration_and_rate(run, tmp_path):
    path = write_film(
        run, Target(str(tmp_path / "walk.gif"), None), Film("contact-sim", steps=1, rate=10, slower=1.0), QUIET
    )
    with Image.open(path) as film:
        assert film.n_frames == pytest.approx(7, abs=1)
        assert film.size == (640, 360)
        first = np.asarray(film.convert("L"))
        film.seek(5)
        assert (np.asarray(film.convert("L")) != first).any()


@pytest.mark.parametrize("rate", [24, 25, 30, 50])
def test_duration_of_a_gif_is_its_number_of_frames_divided_by_the_frame_rate(rate):
    pictures = np.zeros((3 * rate, 4, 4, 3), np.uint8)
    pictures[np.arange(3 * rate), 0, 0] = np.arange(3 * rate)[:, None]
    with Image.open(io.BytesIO(gif(pictures, rate))) as film:
        total_ms = 0
        for number in range(film.n_frames):
            film.seek(number)
            total_ms += film.info["duration"]
    assert total_ms == 3000


def test_gif_that_browsers_slow_down_is_rejected(run):
    with pytest.raises(ConfigError, match="browsers slow down GIFs with more than 50 frames per second"):
        write_film(run, Target("gif", None), Film("simulate", 1, 60, 1.0), QUIET)


def test_film_of_both_models_needs_both_walks(run, tmp_path):
    path = write_film(run, Target("gif", None), Film("both", 1, 5, 1.0), QUIET)
    assert path.name == "paper-both.gif"
    with Image.open(path) as film:
        assert film.n_frames == pytest.approx(4, abs=1)
    run.artifact("simulate").unlink()
    with pytest.raises(StaleError, match="simulate"):
        write_film(run, Target("gif", None), Film("both", 1, 5, 1.0), QUIET)


def test_unknown_film_format_is_rejected(run, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    for name, said in (("walk.avi", "an animation cannot be written as avi"), ("walk.mp4", "needs ffmpeg")):
        with pytest.raises(ConfigError, match=said):
            write_film(run, Target(str(tmp_path / name), None), Film("simulate", 1, 10, 1.0), QUIET)


def test_ffmpeg_receives_the_frames(run, tmp_path, monkeypatch):
    tool = tmp_path / "ffmpeg"
    tool.write_text("#!/bin/sh\n/bin/cat | /usr/bin/wc -c\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    path = write_film(run, Target("mp4", tmp_path / "walk.mp4"), Film("simulate", 1, 5, 1.0), QUIET)
    assert int(path.read_bytes()) % (640 * 360 * 3) == 0


DAMAGES = {
    "cut short": lambda data: data[:-1],
    "emptied": lambda _data: b"",
    "a bit flipped": lambda data: data[:600] + bytes([data[600] ^ 1]) + data[601:],
}
READERS = {
    "figure": lambda run: export_from(run, "figure-06", Target("svg", None), "", QUIET),
    "trajectory": lambda run: export_from(run, "trajectory", Target("csv", None), "contact-sim", QUIET),
    "film": lambda run: write_film(run, Target(None, Path("walk.gif")), Film("contact-sim", 1, 10, 1.0), QUIET),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("reader", READERS)
def test_damaged_result_is_reported_with_the_command_to_recompute_it(run, reader, damage):
    path = run.artifact("contact-sim")
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    with pytest.raises(StaleError) as refused:
        READERS[reader](run)
    assert refused.value.message.startswith(f"{path} is damaged: ")
    assert refused.value.advice == f"`walkerlab contact-sim -c {run.path}` recomputes it."
    assert refused.value.exit_code == 5


def test_damaged_results_that_are_not_needed_are_ignored(run):
    run.artifact("simulate").write_bytes(b"")
    assert export_from(run, "trajectory", Target("csv", None), "contact-sim", QUIET).is_file()


def test_damaged_result_is_reported_in_python(run):
    opened = open_run(run.path)
    run.artifact("compare").write_bytes(b"")
    assert "compare" in opened.stages
    with pytest.raises(StaleError, match=r"compare\.h5 is damaged"):
        opened.result("compare")


def test_export_overwrites_no_result(run):
    before = run.artifact("simulate").read_bytes()
    for owned in ("simulate.h5", "later.h5", ".run.json"):
        with pytest.raises(ConfigError, match="belongs to the results of the run"):
            export_from(run, "trajectory", Target("csv", run.path / owned, width=FIGURE_WIDTH), "simulate", QUIET)
    assert run.artifact("simulate").read_bytes() == before
    assert export_from(
        run, "trajectory", Target("csv", run.path / "mine.csv", width=FIGURE_WIDTH), "simulate", QUIET
    ).is_file()


def test_export_of_an_outdated_result_warns(run, capsys):
    export_from(run, "trajectory", Target("csv", None, width=FIGURE_WIDTH), "simulate", Console())
    assert f"warning: {run.artifact('simulate')} is out of date: " in capsys.readouterr().err


def test_film_of_an_older_result_without_needed_data_is_rejected(run):
    stored = read(run.artifact("simulate"))
    known = {key: value for key, value in stored.identity.config_slice.items() if key != "push_off"}
    write(run.artifact("simulate"), stored, replace(stored.identity, config_slice=known), stored.provenance)
    with pytest.raises(StaleError, match=r"simulate\.h5 is outdated and lacks 'push_off'") as caught:
        write_film(run, Target("gif", None), Film("simulate", 1, 5, 1.0), QUIET)
    assert "walkerlab simulate -c" in caught.value.advice


def test_exports_are_listed(run):
    with pytest.raises(ConfigError) as caught:
        export_from(run, "99", Target(None, None, width=FIGURE_WIDTH), "simulate", QUIET)
    assert {"  figure-07", "  trajectory"} <= set(caught.value.advice.splitlines())
