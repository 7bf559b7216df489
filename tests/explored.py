"""Run `walkerlab explore` as a process, and send requests to it."""

import contextlib
import http.client
import json
import re
import signal
import subprocess
import sys

from browser import PATIENCE


class Served:
    def __init__(self, folder, *options):
        command = [sys.executable, "-m", "walkerlab", "explore", "--no-browser", "--runs", "runs", *options]
        self.folder = folder
        # Start it as a terminal does, because the background job of a script ignores Ctrl-C.
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, cwd=folder,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )  # fmt: skip
        self.url = self.process.stdout.readline().strip()
        port, self.token = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", self.url).groups()
        self.port = int(port)
        self.bearer = {"Authorization": f"Bearer {self.token}"}

    def asked(self, path, body=None, **headers):
        """Return status and answer of a request. It carries the token unless other headers are given."""
        text = body if body is None or isinstance(body, str) else json.dumps(body)
        # Close the socket in any case. An error would keep it alive, and it would then raise a warning in some later
        # test.
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)) as connection:
            connection.request("GET" if body is None else "POST", path, text, headers or self.bearer)
            answer = connection.getresponse()
            said = answer.read()
        return answer.status, json.loads(said) if answer.headers[
            "Content-Type"
        ] == "application/json" else said.decode()

    def walk(self, changes, models=("rigid",), **more):
        return self.asked("/api/walk", {"set": changes, "models": models, **more})

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
