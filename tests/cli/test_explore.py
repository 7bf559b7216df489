"""`walkerlab explore` as a process: who may ask, what is refused, and that it ends when told."""

import http.client
import json
import re
import signal
import subprocess
import sys
import time

import pytest


@pytest.fixture
def served(tmp_path):
    command = [sys.executable, "-m", "walkerlab", "explore", "--no-browser", "--runs", str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        port, token = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)\n", process.stdout.readline()).groups()
        yield process, int(port), token
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def asked(port, body, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
    connection.request("POST", "/api/walk", body, headers)
    answer = connection.getresponse()
    return answer.status, json.loads(answer.read())


def test_questions_are_answered_or_refused_and_the_server_ends_when_told(served):
    process, port, token = served
    bearer = {"Authorization": f"Bearer {token}"}
    assert asked(port, "{}")[0] == 401
    assert asked(port, "{}", **bearer, Origin="http://elsewhere")[0] == 403
    assert asked(port, "{}", **bearer, Host="elsewhere")[0] == 403
    assert asked(port, "no", **bearer)[0] == 400
    status, said = asked(port, json.dumps({"set": {"slope_deg": "steep"}}), **bearer)
    assert (status, said["error"]["key"], said["error"]["value"]) == (422, "slope_deg", "steep")
    status, said = asked(port, json.dumps({"set": {"slope_deg": 2}, "models": ["rigid"]}), **bearer)
    assert (status, said["simulate"]["outcome"], [*said["tracks"]]) == (200, "walked", ["simulate"])
    process.send_signal(signal.SIGTERM)
    began = time.monotonic()
    assert process.wait(10) == 130
    assert time.monotonic() - began < 2
