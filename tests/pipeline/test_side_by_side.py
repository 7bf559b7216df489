"""Tests of stages in parallel processes: same results, reported as they come, and a page before all are complete."""

import os
import re
from dataclasses import replace

import pytest
from process_table import workers_below

from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.run.executor import any_side_by_side
from walkerlab.pipeline.run.workers import WorkerDiedError
from walkerlab.pipeline.store.artifact import read
from walkerlab.scene.omissions import STILL_COMPUTED, STOPPED

STEEP = "slope_rad=1.2"
NUMBERS = ("drop", "roll", "bounce", "survey")


def with_page_early(graph):
    return Graph(*(replace(stage, early_with=("drop",)) if stage.name == "page" else stage for stage in graph.stages))


@pytest.mark.parametrize("sets", [(), (STEEP,)])
def test_several_processes_give_the_serial_result_and_leave_no_worker_behind(toy, tmp_path, sets):
    one = toy.execute("page", *sets)
    files = {name: one.run_dir / f"{name}.h5" for name in NUMBERS}
    digests = {name: read(path).digest() for name, path in files.items() if path.exists()}
    toy.runs = tmp_path / "others"
    two = toy.execute("page", *sets, jobs=2)
    assert {name: read(two.run_dir / f"{name}.h5").digest() for name in digests} == digests
    assert sorted((done.stage.name, done.action) for done in two.steps) == sorted(
        (d.stage.name, d.action) for d in one.steps
    )
    assert str(two.no_answer) == str(one.no_answer)
    assert set(two.left_out) == set(one.left_out)
    assert workers_below(os.getpid()) == []
    assert toy.execute("page", *sets, jobs=2).reused


def with_picture_early(graph):
    stages = with_page_early(graph).stages
    walks = ("drop", "roll", "bounce")
    return Graph(*(replace(stage, early_with=walks) if stage.name == "picture" else stage for stage in stages))


def test_figures_are_on_the_page_before_long_stages_run(toy, listener):
    toy.graph = with_picture_early(toy.graph)
    toy.execute("page", reporter=listener)
    walked = next(page for page in listener.pages if "'bounce'" in page)
    assert "'picture'" in walked
    assert f"survey: {STILL_COMPUTED}" in walked
    assert "without ['survey']" not in (toy.runs / "paper/figures/figure-01.svg").read_text()


@pytest.mark.parametrize(("jobs", "error"), [(1, KeyboardInterrupt), (2, WorkerDiedError)])
def test_page_of_an_interrupted_command_says_so(toy, jobs, error):
    toy.graph = with_picture_early(toy.graph)
    waits = "\n    while not (folder / 'report.html').exists():\n        time.sleep(0.01)\n    raise KeyboardInterrupt"
    toy.edit("survey", "jobs):", f"jobs, folder):{waits}")
    with pytest.raises(error):
        toy.execute("page", jobs=jobs)
    page = (toy.runs / "paper" / "report.html").read_text()
    assert f"survey: {STOPPED}" in page
    assert STILL_COMPUTED not in page


@pytest.mark.parametrize("jobs", [1, 2])
def test_early_page_says_what_is_missing(toy, listener, jobs):
    toy.graph = with_page_early(toy.graph)
    final = toy.execute("page", reporter=listener, jobs=jobs).run_dir / "report.html"
    assert f"picture: {STILL_COMPUTED}" in listener.pages[0]  # It is random which of the parallel stages are ready.
    assert "'drop'" in listener.pages[0]
    assert STILL_COMPUTED not in final.read_text()


def test_every_stage_reports_start_progress_and_end(toy, listener):
    toy.execute("page", reporter=listener, jobs=2)
    stages = [stage for stage, _, _ in listener.begun]
    assert sorted(stages) == ["bounce", "drop", "page", "picture", "roll", "survey"]
    assert listener.begun[0][1] == "1 of 6"
    assert [place.split()[0] for _, place, _ in listener.begun] == ["1", "2", "3", "4", "5", "6"]
    assert re.fullmatch(r"page: ran in \d+\.\d\d s", listener.ended[-1])
    assert "still to run: page" in listener.ended[-2]
    assert "dropping" in [label for label, _ in listener.started]


def test_stage_that_ran_before_reports_its_duration(toy, listener):
    toy.execute("drop")
    toy.execute("drop", force=True, reporter=listener)
    ((_, _, expected),) = listener.begun
    assert 0.0 <= expected < 60.0


def test_stage_that_measures_times_runs_alone(toy, listener):
    survey = replace(toy.graph["survey"], work="times")
    toy.graph = Graph(*(survey if stage.name == "survey" else stage for stage in toy.graph.stages))
    told = []
    listener.end = lambda said: told.append(said.split(":")[0])
    begin = listener.begin
    listener.begin = lambda stage, *rest: told.append(f"{stage} begins") or begin(stage, *rest)
    toy.execute("page", reporter=listener, jobs=2)
    place = told.index("survey begins")
    assert told[place + 1] == "survey"
    assert {name.split()[0] for name in told[:place] if name.endswith("begins")} == set(told[:place]) & set(NUMBERS)


def test_failure_in_a_process_is_reported_with_traceback(toy):
    toy.edit("roll", "period = ", "period = 1 / 0 + ")
    with pytest.raises(ZeroDivisionError) as caught:
        toy.execute("page", jobs=2)
    assert "roll.py" in caught.value.__notes__[0]
    assert not (toy.runs / "paper" / "roll.h5").exists()


def test_killed_process_is_reported(toy):
    toy.edit("roll", "period = ", "import os; os.kill(os.getpid(), 9); period = ")
    with pytest.raises(WorkerDiedError, match="SIGKILL"):
        toy.execute("page", jobs=2)


def test_stages_that_need_each_other_are_not_run_side_by_side(toy):
    config, _ = toy.loaded()
    chain = [toy.graph[name] for name in ("drop", "roll")]
    assert not any_side_by_side(chain, config)
    assert any_side_by_side([*chain, toy.graph["survey"]], config)
