"""Tests of JSON values as text for people, and of progress."""

from pathlib import Path

import pytest

from walkerlab.errors import NoAnswer
from walkerlab.pipeline.run.runner import StageReport
from walkerlab.views.cli import console
from walkerlab.views.cli.console import Console, StageLine
from walkerlab.views.cli.request import Request
from walkerlab.views.cli.stage import report_lines
from walkerlab.views.report.tables import LONGEST_CELL, describe_summary, record_lines

SENTENCES = "One gait cycle of the rigid model, to scale. " * 5


def test_omitted_column_of_sentences_is_mentioned_below_the_table():
    rows = [{"number": 2, "svg": "figures/figure-02.svg", "caption": SENTENCES}, {"svg": "own.svg", "caption": "-"}]
    lines = list(describe_summary({"figures": rows}))
    assert lines[1].split() == ["number", "svg"]
    assert lines[2].split() == ["2", "figures/figure-02.svg"]
    assert lines[-1].strip() == "with --json also: caption"
    assert max(map(len, lines)) < LONGEST_CELL


def test_table_with_only_sentences_is_shown():
    assert record_lines([{"caption": SENTENCES}])[1] == SENTENCES.rstrip()


@pytest.fixture
def clock(monkeypatch):
    """Return a clock that is set by hand and begins at 0 s."""
    now = [0.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: now[0])
    return now


def test_remaining_time_is_estimated_only_after_a_tenth_of_the_work(clock):
    line = StageLine(Console(quiet=True), "tune", "", None)
    line.start("tune: cells", 100)
    told = []
    for clock[0], done in ((1.0, 5), (2.0, 15), (4.0, 20), (8.0, 40), (12.0, 60)):
        line.advance(done - line.done)
        told.append(line.seconds_left())
    assert told[:2] == [None, None]
    # computed from the rates between 5 and 20, 15 and 40, and 20 and 60
    assert told[2:] == pytest.approx([16.0, 14.4, 8.0])


def test_slow_start_is_ignored_once_the_pace_is_known(clock):
    line = StageLine(Console(quiet=True), "sweep", "", None)
    line.start("sweep", 400)
    for clock[0], done in ((8.0, 2), (12.0, 42), (16.0, 82), (20.0, 122)):
        line.advance(done - line.done)
    assert line.seconds_left() == pytest.approx((400 - 122) / 10.0)


def test_remaining_time_is_never_zero_for_an_overdue_stage(clock):
    line = StageLine(Console(quiet=True), "fixedpoint", "", expected_s=5.0)
    clock[0] = 3.0
    assert line.pace() == "3 s, about 2 s left"
    clock[0] = 9.0
    assert line.pace() == "9 s"


def test_remaining_time_decreases_during_a_long_part(clock):
    line = StageLine(Console(quiet=True), "engines", "", None)
    line.start("engines", 4)
    for clock[0] in (10.0, 20.0):
        line.advance()
    told = []
    for clock[0] in (24.0, 32.0, 39.0, 41.0):
        told.append(line.seconds_left())
    assert told == [16.0, 8.0, 1.0, None]


@pytest.mark.parametrize(("summary", "stored"), [({}, False), ({"period_s": 0.7}, True)])
def test_missing_answer_is_not_reported_as_stored(summary, stored):
    said = {"message": "none is installed", "advice": "Install one."}
    summary = {**summary, "no_answer": said}
    artifact = Path("runs/paper/drop.h5")
    report = StageReport(
        "drop", artifact.parent, artifact, False, 0.0, (), summary, (), NoAnswer(said["message"], said["advice"])
    )
    assert (f"stored in {artifact}" in report_lines(Request("drop"), report)) == stored
