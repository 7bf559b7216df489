"""Tests of `walkerlab sweep`, `walkerlab diff` and the list of all runs, as a user types them."""

import csv
import io
import json
import re
from pathlib import Path

import pytest

from walkerlab.pipeline.headlines import MAX_HEADLINES, Pair, difference
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.views.cli.housekeeping import comparison_lines, percent
from walkerlab.views.cli.stored import file_lines

SWEEP = ("sweep", "--stage", "drop", "--jobs", "1")


def test_sweep_prints_one_object_and_writes_file_table_figure_and_page(swept):
    toy, value = swept
    assert (value["done"], value["failed"], value["reused"], value["points"]) == (6, 0, 0, 6)
    assert value["parameters"] == {"gravity_m_s2": [1.0, 5.0, 9.0], "slope_rad": [0.1, 1.2]}
    assert value["outcomes"] == {"answered": 3, "no-answer": 3}
    assert value["stage"] == "sweep"
    for path in (value["file"], value["csv"], value["html"], *value["figures"]):
        assert (toy.folder / path).stat().st_size > 100
    page = (toy.folder / value["html"]).read_text()
    assert "<svg" in page
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )


def test_repeated_sweep_prints_the_table_and_computes_nothing(swept):
    toy, _ = swept
    done = toy(*SWEEP, "--over", "gravity_m_s2=1:9:3", "--over", "slope_rad=[0.1, 1.2]", "--csv")
    assert "6 of 6 points exist already" in done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [row["outcome"] for row in rows] == ["answered", "no-answer"] * 3
    assert float(rows[4]["period_s"]) == (2 / 9) ** 0.5


def test_sweep_block_of_the_config_equals_the_options(swept):
    toy, value = swept
    over = "    gravity_m_s2: 1:9:3\n    slope_rad: [0.1, 1.2]\n"
    (toy.folder / "block.yaml").write_text(f"name: paper\nextends: paper\nsweep:\n  stage: drop\n  over:\n{over}")
    again = json.loads(toy("sweep", "-c", "block.yaml", "--json").stdout)
    assert again["reused"] == 6
    assert again["file"] == value["file"]


def test_dry_run_of_a_sweep_lists_points_and_changes_nothing(swept):
    toy, _ = swept
    before = sorted(toy.folder.rglob("*"))
    text = toy(*SWEEP, "--over", "gravity_m_s2=1:9:5", "--set", "slope_rad=0.1", "--dry-run").stdout
    assert "  gravity_m_s2=3.0" in text
    assert "5 points, 3 already computed, 2 to compute" in text
    assert sorted(toy.folder.rglob("*")) == before


def test_invalid_sweep_values_parameters_and_engines_exit_3(swept):
    toy, _ = swept
    done = toy(*SWEEP, "--over", "gravity_m_s2=[1, -2]")
    assert done.returncode == 3
    assert done.stderr.count("gravity_m_s2: -2 is out of bounds") == 1
    assert toy(*SWEEP, "--over", "gravity=[1]").returncode == 3
    assert toy("sweep", "--stage", "page", "--over", "gravity_m_s2=[1]").returncode == 3
    assert toy(*SWEEP, "--over", "gravity_m_s2=[1]", "--engine", "abacus").returncode == 3


def test_sweep_stops_after_its_first_chunk_if_show_names_an_unknown_quantity(toy):
    few = ("--jobs", "1", "--chunk-seconds", "1e-9")
    done = toy("sweep", "--over", "gravity_m_s2=1:9:400", "--stage", "drop", "--show", "nonsense", *few)
    assert done.returncode == 3
    assert "is not among the quantities of the points computed so far" in done.stderr
    again = toy("sweep", "--over", "gravity_m_s2=1:9:400", "--stage", "drop", "--dry-run", "--json")
    assert 0 < json.loads(again.stdout)["reused"] < 400


def test_clean_removes_sweeps(swept, tmp_path):
    toy, _ = swept
    done = toy("clean", "--dry-run", "--json")
    removed = json.loads(done.stdout)["removed"]
    assert any("sweep-chunks/drop-" in name for name in removed)
    assert any(name.endswith("sweep.html") for name in removed)


def test_clean_counts_sweep_chunks_instead_of_listing_them(swept):
    toy, _ = swept
    chunks = [line for line in toy("clean", "--all", "--dry-run").stdout.splitlines() if "sweep-chunks" in line]
    assert len(chunks) == 1
    assert re.search(r"sweep-chunks/drop-\w+-\*", chunks[0]) or chunks[0].endswith(".h5")


def test_many_files_of_a_kind_are_summarised_in_one_line():
    files = [Path(f"runs/a/sweep-chunks/drop-1234-{n}.h5") for n in range(300)] + [Path("runs/a/drop.h5")]
    assert file_lines(files, dict.fromkeys(files, 10_000)) == [
        "runs/a/sweep-chunks/drop-1234-* (300 files, 3.0 MB)",
        "runs/a/drop.h5",
    ]


def test_diff_lists_differences_of_config_and_results(toy):
    toy("roll")
    toy("roll", "--set", "gravity_m_s2=4.905")
    found = json.loads(toy("diff", "paper", "paper@gravity_m_s2=4.905", "--json").stdout)
    assert found["config"] == [{"key": "gravity_m_s2", "first": 9.81, "second": 4.905}]
    numbers = {pair["name"]: pair for pair in found["numbers"]["drop"]}
    assert numbers["period_s"]["change"] == pytest.approx(2**0.5 - 1, rel=1e-12)
    text = toy("diff", "paper", "paper@gravity_m_s2=4.905").stdout
    assert "+41.4 %" in text


def test_diff_labels_runs_with_the_same_name_by_folder(toy):
    toy("roll", "--runs", "here")
    toy("roll", "--runs", "there", "--set", "gravity_m_s2=4.905", "--set", "name=paper")
    (there,) = (toy.folder / "there").iterdir()
    there.rename(toy.folder / "there" / "paper")
    head = toy("diff", "here/paper", "there/paper").stdout.splitlines()[1]
    assert head.split() == ["here/paper", "there/paper"]


def test_diff_shows_no_percentage_for_errors_and_rounding():
    assert percent(Pair("period_s", 1.0, 1.5, 0.5)) == "+50 %"
    assert percent(Pair("period_s", 1.5, 1.5, 0.0)) == "the same"
    assert percent(Pair("energy_drift_J", 1e-3, 2e-3, 1.0)) == ""
    assert percent(Pair("max_scuff_depth_m", 1e-17, 3e-17, 2.0)) == ""


def test_diff_of_different_walks_is_short_unless_all_is_requested():
    steps = [{f"x{place}": float(place) for place in range(500)}, {f"x{place}": 2.0 * place for place in range(500)}]
    first, second = ({"contact-sim": Content({}, {"steps": 2, "step_periods_s": [0.7, t], "of": one})}
                     for t, one in zip((0.7, 0.8), steps, strict=True))  # fmt: skip
    found = difference(first, second, (None, None))
    folders = (RunFolder(Path("runs"), "one"), RunFolder(Path("runs"), "two"))
    short, whole = (comparison_lines(folders, found, [], every) for every in (False, True))
    assert [line.split() for line in short if "last_step_period_s" in line] == [
        ["last_step_period_s", "0.7", "0.8", "+14.3", "%"]
    ]
    assert len(short) <= 2 + 2 + MAX_HEADLINES + 1
    assert short[-1] == "500 other values differ; list them with --all"
    assert len(whole) > 500


def test_status_lists_all_runs_or_one(toy):
    toy("roll")
    toy("drop", "--set", "strides=7")
    status = json.loads(toy("status", "--json").stdout)
    assert {run["name"]: run["stages"] for run in status["runs"]} == {
        "paper": ["drop", "roll"],
        "paper@strides=7": ["drop"],
    }
    assert all(run["current"] == run["stages"] for run in status["runs"])
    assert "all runs in runs:" in toy("status").stdout
    one = json.loads(toy("status", "paper@strides=7", "--json").stdout)
    assert one["run_dir"] == "runs/paper@strides=7"
    assert {row["stage"]: row["state"] for row in one["stages"]}["drop"] == "current"


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_bug_at_one_point_exits_1_and_keeps_the_other_points(toy, tmp_path, jobs):
    source = tmp_path / "source" / "toy" / "drop.py"
    text = source.read_text()
    assert "    progress.advance()" in text
    broken = "    assert config.gravity_m_s2 != 5.0, 'a bug'\n    progress.advance()"
    source.write_text(text.replace("    progress.advance()", broken))
    over = ("--over", "gravity_m_s2=1:9:5", "--set", "slope_rad=0.1")
    done = toy("sweep", "--stage", "drop", "--jobs", jobs, *over, "--json")
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert "AssertionError: a bug" in done.stderr
    value = json.loads(done.stdout)
    assert (value["done"], value["failed"], value["error"]["exit_code"]) == (4, 1, 1)


def test_points_without_an_answer_are_not_failures(toy):
    done = toy("sweep", "--stage", "drop", "--jobs", "2", "--over", "slope_rad=[0.1, 1.2]", "--json")
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert json.loads(done.stdout)["outcomes"] == {"answered": 1, "no-answer": 1}
