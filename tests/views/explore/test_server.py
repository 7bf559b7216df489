"""Tests of `walkerlab explore` as a process: values equal those of the command, and errors have messages."""

import contextlib
import http.client
import json
import os
import shlex
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from explored import Served
from forks import forks

import walkerlab
from walkerlab.config.loader import load


def settings(seed, count):
    """Draw random settings of three walkers."""
    random = np.random.default_rng(seed)
    for number in range(count):
        config = ("paper", "simplest", "kneed")[number % 3]
        changes = {"slope_deg": round(float(random.uniform(0.5, 4.0)), 3), "gravity_m_s2": float(random.uniform(1, 20))}
        if config == "paper":
            changes |= {"walker.hip_mass_kg": float(random.uniform(5, 20)), "walker.leg_mass_kg": 4.5}
        yield config, changes


def same(served, config, changes, models):
    """Check that the answer of the server equals that of the command."""
    status, said = served.walk(changes, models, config=config)
    assert status == 200
    for stage in ("fixedpoint", *(name for model, name in STAGES.items() if model in models)):
        done = walkerlab.run(stage, config, set=changes, runs=served.folder / "asked")
        if stage not in said:
            assert "error" in said["fixedpoint"]
            continue
        if done.no_answer is not None:
            # The advice of the command begins with nearby gaits. The page does not search for them, since a moved
            # slider cannot wait.
            assert done.summary["error"]["advice"].endswith(said[stage]["error"]["advice"])
            assert said[stage]["error"] | {"advice": ""} == done.summary["error"] | {"advice": ""}
        there = {key: value for key, value in said[stage].items() if key != "error"}
        printed = {key: done.summary[key] for key in there}
        assert json.loads(json.dumps(printed)) == there
    return said


STAGES = {"rigid": "simulate", "contact": "contact-sim"}


@pytest.mark.parametrize(("config", "changes"), list(settings(1, 9)))
def test_page_values_equal_those_of_the_command(served, config, changes):
    same(served, config, changes, ["rigid"])


@pytest.mark.parametrize(
    "changes", [{"slope_deg": 3}, {"contact.stiffness": 2e4, "contact.terrain": "after-mid-swing"}]
)
def test_contact_walk_values_equal_those_of_the_command(served, changes):
    said = same(served, "paper", changes, ["rigid", "contact"])
    assert said["tracks"].keys() == {"simulate", "contact-sim"}


def test_copied_commands_print_the_values_on_the_page(served):
    changes = {"slope_deg": 2.345678901, "walker.hip_mass_kg": 12.5, "contact.terrain": "after-mid-swing"}
    _, said = served.walk({**changes, "ground.heights_m": [0.0, 0.001]}, ["rigid", "contact"])
    lines = said["command"].splitlines()
    assert [line.split()[:2] for line in lines] == [["walkerlab", stage] for stage in ("fixedpoint", *STAGES.values())]
    for line in lines:
        _, stage, *options = shlex.split(line)
        arguments = [stage, *options, "--runs", "asked", "--json"]
        done = forks().run("walkerlab", arguments, served.folder, dict(os.environ))
        assert done.returncode == 0, done.stderr
        printed = json.loads(done.stdout)
        assert {key: printed[key] for key in said[stage]} == said[stage]


def test_walk_beyond_the_first_flip_limps(served):
    """This is the lesson of docs/explore.md."""
    changes = {"slope_deg": 4.7, "strides": 50, "contact.terrain": "after-mid-swing"}
    _, said = served.walk(changes, ["rigid", "contact"])
    for stage in STAGES.values():
        touches = [0.0, *said["tracks"][stage]["meta"]["strikes"]]
        assert len(touches) >= 100
        assert abs(np.diff(touches)[-1] - np.diff(touches)[-2]) > 0.05
    assert not said["fixedpoint"]["stable"]


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """Start another server. The last test that uses it ends it."""
    one = Served(tmp_path_factory.mktemp("other"))
    yield one
    one.close()


def test_two_servers_have_different_tokens(served, other):
    cookies = []
    for one in (served, other):
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", one.port)) as connection:
            connection.request("GET", f"/?token={one.token}")
            with connection.getresponse() as answer:
                cookies.append(answer.headers["Set-Cookie"].partition(";")[0])
    for one in (served, other):
        assert one.asked("/runs/none", Cookie="; ".join(cookies))[0] == 404
        assert one.asked("/runs/none", Cookie=cookies[one is served])[0] == 401


def test_request_after_the_death_of_an_idle_worker_is_answered(other):
    for slope in (2, 2.1):
        for file in workers_of(other.process.pid):
            os.kill(int(file.parts[2]), signal.SIGKILL)
        status, said = other.walk({"slope_deg": slope}, models=[])
        assert (status, said["fixedpoint"]["stable"]) == (200, True)


def test_server_ends_on_an_interrupt_and_cleans_up(other):
    began = time.monotonic()
    other.process.send_signal(signal.SIGINT)
    assert other.process.wait(10) == 130
    assert time.monotonic() - began < 2
    assert not workers_of(other.process.pid)


def test_occupied_port_is_a_usage_error(served, tmp_path):
    arguments = ["explore", "--no-browser", "--port", served.port]
    done = forks().run("walkerlab", arguments, tmp_path, dict(os.environ))
    assert (done.returncode, done.stdout) == (2, "")
    assert "is not available" in done.stderr
    assert "Traceback" not in done.stderr


def test_slope_without_a_gait_gets_a_normal_response_with_the_reason(served):
    status, said = served.walk({"slope_deg": 20})
    assert (status, said["fixedpoint"]["error"]["exit_code"]) == (200, 4)
    assert "no gait" in said["fixedpoint"]["error"]["message"]
    assert "simulate" not in said


@pytest.mark.parametrize(
    ("changes", "key", "message"),
    [
        ({"slope_deg": "steep"}, "slope_deg", "slope_deg"),
        ({"walker.hip_mas_kg": 3}, "walker.hip_mas_kg", "did you mean walker.hip_mass_kg?"),
        ({"slope_deg": 1, "walker.leg_mass_kg": -1}, "walker.leg_mass_kg", "from 1e-12 to 1e6 (kg)"),
        ({"a: [": 1}, "a: [", ""),
        ({"walker": None}, "walker", "walker"),
        ({"": 1}, "", ""),
    ],
)
def test_invalid_value_is_rejected_with_the_message_of_the_command(served, changes, key, message):
    status, said = served.walk(changes)
    assert (status, said["error"]["key"]) == (422, key)
    assert message in said["error"]["message"]
    assert served.asked("/api/numbers", {"set": changes})[0] == 422


@pytest.mark.parametrize(
    ("status", "path", "body", "headers"),
    [
        (401, "/api/walk", "{}", {"X": "y"}),
        (401, "/api/walk", "{}", {"Authorization": "Bearer wrong"}),
        (401, "/", None, {"X": "y"}),
        (401, "/?token=wrong", None, {"X": "y"}),
        (401, "/runs/paper/report.html", None, {"X": "y"}),
        (403, "/api/walk", "{}", {"Origin": "http://elsewhere"}),
        (403, "/api/walk", "{}", {"Host": "elsewhere:80"}),
        (403, "/", None, {"Host": "elsewhere:80"}),
        (400, "/api/walk", "no", {}),
        (400, "/api/walk", "[]", {}),
        (400, "/api/walk", '{"set": 3}', {}),
        (400, "/api/walk", '{"models": ["walking"]}', {}),
        (400, "/api/walk", '{"models": [[]]}', {}),
        (400, "/api/walk", '{"config": "/etc/passwd"}', {}),
        (400, "/api/walk", "[" * 50_000, {}),
        (400, "/api/job", '{"kind": "anything"}', {}),
        (413, "/api/walk", "x" * 100_001, {}),
        (404, "/api/other", "{}", {}),
        (404, "/runs/../../../etc/passwd", None, {}),
        (404, "/runs/%2e%2e/%2e%2e/etc/passwd", None, {}),
        (404, "/runs/a%00b", None, {}),
        (404, "//[", None, {}),
    ],
)
def test_unauthorised_and_malformed_requests_are_rejected(served, status, path, body, headers):
    found, said = served.asked(path, body, **({**served.bearer, **headers} if "X" not in headers else headers))
    assert found == status
    assert said["error"]["message"]


def test_circular_link_in_the_runs_folder_is_not_found(served):
    runs = served.folder / "runs"
    runs.mkdir(exist_ok=True)
    (runs / "circle").symlink_to(runs / "circle")
    status, said = served.asked("/runs/circle/report.html")
    assert status == 404
    assert said["error"]["message"]


def test_decimal_comma_is_rejected_with_a_suggestion(served):
    status, said = served.walk({"slope_deg": "0,5"})
    assert status == 422
    assert "did you mean 0.5?" in said["error"]["message"]


def test_page_is_small(served):
    status, page = served.asked(f"/?token={served.token}")
    assert status == 200
    assert len(page.encode()) < 150_000


def test_newest_of_many_requests_is_answered_in_constant_memory(served):
    statuses = []

    def ask(slope):
        statuses.append(served.walk({"slope_deg": slope})[0])

    for slope in (2, 2.1, 2.2):
        served.walk({"slope_deg": slope})
    # On a busy machine, the worker for curves has low priority and may still load modules. Wait until it has answered.
    assert served.asked("/api/along", {"set": {"continuation.over": "nothing"}})[0] == 422
    processes = [served.process.pid, *(int(file.parts[2]) for file in workers_of(served.process.pid))]
    before = sum(map(resident_kB, processes))
    threads = [threading.Thread(target=ask, args=(1 + number / 100,)) for number in range(200)]
    for thread in threads:
        thread.start()
        time.sleep(0.01)
    for thread in threads:
        thread.join()
    status, said = served.walk({"slope_deg": 2.5})
    assert len(statuses) == 200
    assert set(statuses) <= {200, 409}
    assert statuses.count(409) > 10
    assert (status, said["simulate"]["outcome"]) == (200, "walked")
    assert sum(map(resident_kB, processes)) < before + 30_000


def resident_kB(process):
    fields = dict(line.split(":", 1) for line in Path(f"/proc/{process}/status").read_text().splitlines())
    return int(fields["VmRSS"].split()[0])


def test_saved_config_contains_only_changes_and_overwrites_no_file(served):
    asked = {"set": {"slope_deg": 3, "walker.hip_mass_kg": 12}, "name": "mine.yaml"}
    status, said = served.asked("/api/save", asked)
    assert (status, Path(said["file"])) == (200, served.folder / "mine.yaml")
    saved = load(served.folder / "mine.yaml").config
    assert saved == load(None, ["slope_deg=3", "walker.hip_mass_kg=12", "name=mine"]).config
    assert "leg_mass_kg" not in said["text"]
    assert served.asked("/api/save", asked)[0] == 409
    assert served.asked("/api/save", {**asked, "name": "../mine.yaml"})[0] == 400
    assert served.asked("/api/save", {"set": {"slope_deg": 99}, "name": "steep"})[0] == 422
    assert "slope_deg: 3.0" in said["text"]  # The value is saved as it was typed.
    status, said = served.asked("/api/save", {**asked, "name": "my walker"})
    assert (status, list(served.folder.glob("my walker*"))) == (422, [])
    assert "is not valid" in said["error"]["message"]
    assert served.walk({}, config="mine.yaml")[1]["command"].startswith("walkerlab fixedpoint -c mine.yaml\n")


def test_gait_curves_equal_those_of_continuation(served):
    span = {"over": "slope_deg", "from": 0.5, "to": 5.0, "points": 40, "periods": 1}
    block = {f"continuation.{key}": value for key, value in span.items()}
    status, said = served.asked("/api/along", {"set": block})
    assert (status, said["over"]) == (200, "slope_deg")
    summary = walkerlab.run("continuation", set=block, runs=served.folder / "asked").summary
    [limit] = {branch["stable_range"][1] for branch in summary["branches"] if branch["stable_range"]}
    stable = [x for curve in said["curves"] for x, is_so in zip(curve["value"], curve["stable"], strict=True) if is_so]
    assert 0.9 * limit < max(stable) <= limit


def test_attractors_are_not_returned_as_branches(served):
    """The page requests only gaits of one step, for which there are no attractors."""
    span = {"over": "slope_deg", "from": 0.86, "to": 0.87, "points": 4, "periods": 2}
    block = {f"continuation.{key}": value for key, value in span.items()}
    status, said = served.asked("/api/along", {"config": "simplest", "set": block})
    assert (status, {curve["model"] for curve in said["curves"]}) == (200, {"rigid"})


def test_abandoned_gait_requests_are_dropped_and_their_worker_kept(served):
    span = {"over": "slope_deg", "from": 0.5, "to": 5.0, "points": 200, "periods": 1, "model": "contact"}
    block = {f"continuation.{key}": value for key, value in span.items()}
    answers = []

    def ask(**more):
        answers.append(served.asked("/api/along", {"set": {**block, **more}})[0])

    rigid = {"continuation.model": "rigid", "continuation.points": 12}
    ask(**rigid)
    [worker] = [file for file in workers_of(served.process.pid) if nice(file.parts[2]) > nice(served.process.pid)]
    before = ticks_of(worker)
    first = threading.Thread(target=ask)
    first.start()
    end = time.monotonic() + 60
    # Wait until the worker computes the first request.
    while ticks_of(worker) - before < SOME_TICKS and time.monotonic() < end:
        time.sleep(0.05)
    ask(**rigid)
    first.join()
    assert sorted(answers) == [200, 200, 409]
    assert worker in workers_of(served.process.pid)


def test_sliders_exist_for_the_parameters_of_the_walker(served):
    _, said = served.asked("/api/numbers", {"config": "simplest", "set": {"slope_deg": 0.4}})
    keys = {number["key"]: number for number in said["numbers"]}
    assert keys["slope_deg"]["value"] == pytest.approx(0.4)
    assert not any(key.startswith("contact.") for key in keys)
    _, said = served.asked("/api/numbers", {"config": "kneed"})
    keys = {number["key"]: number for number in said["numbers"]}
    assert keys["walker.thigh.mass_kg"]["unit"] == "kg"
    assert "checkerboard" in keys["contact.terrain"]["words"]
    for number in keys.values():
        assert "from" not in number or number["from"] <= number["start"] <= number["to"]


def test_slider_range_is_valid_and_wide(served):
    for config in ("kneed", "paper"):
        _, said = served.asked("/api/numbers", {"config": config})
        keys = {number["key"]: number for number in said["numbers"]}
        for key, number in keys.items():
            for end in {"from", "to"} & number.keys():
                status, answer = served.asked("/api/numbers", {"config": config, "set": {key: number[end]}})
                assert status == 200, answer
    # The slider ends at the length of the leg.
    assert keys["walker.foot_to_mass_m"]["to"] == pytest.approx(1.0, rel=0.01)
    assert keys["walker.foot_radius_m"]["to"] == pytest.approx(0.3)  # The range is from 1 mm to large feet that roll.
    assert keys["push_off.impulse_N_s"]["to"] == pytest.approx(0.1 * 20 * (9.81 * 1) ** 0.5)
    assert keys["walker.hip_mass_kg"]["log"]
    assert not keys["slope_deg"]["log"]
    assert "from" not in keys["ground.heights_m"]  # A list has no slider, so it is typed.
    assert "seed" not in keys  # No walk depends on the seed.
    assert {key for key in keys if keys[key].get("gaits")} >= {"slope_deg", "contact.stiffness", "push_off.impulse_N_s"}
    assert not keys["ground.roughness_m"]["gaits"]  # Gaits are for even ground only.
    _, said = served.asked("/api/numbers", {"config": "level"})
    [slope] = [number for number in said["numbers"] if number["key"] == "slope_deg"]
    assert slope["from"] < 0 < slope["to"]  # A driven walker can also walk uphill.


def test_terminated_server_leaves_no_worker_or_report_process(tmp_path):
    one = Served(tmp_path)
    try:
        assert one.asked("/api/job", {"kind": "report"})[0] == 200
        while not at_work_for(tmp_path):
            time.sleep(0.05)
        one.process.send_signal(signal.SIGTERM)
        began = time.monotonic()
        assert one.process.wait(10) == 130
        assert time.monotonic() - began < 2
        assert not at_work_for(tmp_path)
        assert not workers_of(one.process.pid)
    finally:
        one.close()


def test_report_process_ends_when_the_server_is_killed(tmp_path):
    one = Served(tmp_path)
    assert one.asked("/api/job", {"kind": "report"})[0] == 200
    while not at_work_for(tmp_path):
        time.sleep(0.05)
    one.close()
    deadline = time.monotonic() + 5
    while at_work_for(tmp_path):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_jobs_import_nothing_from_the_start_folder(tmp_path):
    one = Served(tmp_path)
    try:
        (tmp_path / "signal.py").write_text(f"open({str(tmp_path / 'imported')!r}, 'w')")
        assert one.asked("/api/job", {"kind": "report"})[0] == 200
        deadline = time.monotonic() + 30
        while not one.asked("/api/job")[1]["progress"]:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert not (tmp_path / "imported").exists()
    finally:
        one.close()


def at_work_for(folder):
    """Return the commands that run for a folder of runs."""
    return [file for file in Path("/proc").glob("[0-9]*/cmdline") if f"{folder / 'runs'}\0--json" in text_of(file)]


SOME_TICKS = 30  # clock ticks of processor time, about 0.3 s


def nice(process):
    """Return the niceness of a process."""
    return os.getpriority(os.PRIO_PROCESS, int(process))


def ticks_of(worker):
    """Return the processor time of a worker, in clock ticks."""
    fields = (worker.parent / "stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def workers_of(process):
    """Return the running processes that a process has started."""
    return [file for file in Path("/proc").glob("[0-9]*/status") if f"PPid:\t{process}\n" in text_of(file)]


def text_of(file):
    try:
        return file.read_text()
    except OSError:
        return ""


def test_notebook_shows_the_page_in_a_frame(tmp_path, monkeypatch):
    page = walkerlab.explore(walkerlab.kneed(), slope_deg=3, runs=tmp_path)
    try:
        assert f'<iframe src="{page.url}"' in page._repr_html_()
        said = page.answer("/api/walk", {"models": ["rigid"]})[1]
        assert said["fixedpoint"]["period_s"] == walkerlab.find_gait(walkerlab.kneed(), slope_deg=3).summary["period_s"]
        monkeypatch.chdir(tmp_path)
        page.answer("/api/save", {"set": {"walker.hip_mass_kg": 0.7}, "name": "kneed-of-mine"})
        saved = load(tmp_path / "kneed-of-mine.yaml").config
        assert (saved.walker.type, saved.walker.hip_mass_kg) == ("kneed", 0.7)
    finally:
        page.close()
