"""The server of `walkerlab explore`: the loopback address alone, a token, one worker that computes."""

import json
import secrets
import threading
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from walkerlab.explore.walks import STAGES, Question, answered
from walkerlab.workers import Worker, WorkerDiedError

LONGEST_BODY = 100_000


class Server(ThreadingHTTPServer):
    """Answers questions about one config; of those that wait, only the newest."""

    daemon_threads = True

    def __init__(self, port: int, base: Question) -> None:
        """Listen; port 0 is any that is free."""
        super().__init__(("127.0.0.1", port), Handler)
        self.base = base
        self.token = secrets.token_urlsafe(16)
        self.worker = Worker(("walkerlab.explore.walks",))
        self._turn, self._newest = threading.Lock(), 0

    @property
    def host(self) -> str:
        """As a browser names this server."""
        return f"127.0.0.1:{self.server_port}"

    def ask(self, question: Question) -> tuple[int, dict[str, Any]]:
        """The answer once the worker is free; status 409 if a newer question came meanwhile."""
        self._newest += 1
        number = self._newest
        with self._turn:
            if number != self._newest:
                return 409, {"error": {"message": "a newer question was asked meanwhile"}}
            try:
                return self.worker.do(partial(answered, question))
            except WorkerDiedError as error:
                self.worker = Worker(("walkerlab.explore.walks",))
                return 500, {"error": {"message": error.message, "advice": error.advice}}

    def close(self) -> None:
        """End the worker at once, whatever it is at, and listen no more."""
        self.worker.process.kill()
        self.worker.ended()
        self.server_close()


class Handler(BaseHTTPRequestHandler):
    """One request."""

    server: Server

    def do_POST(self) -> None:
        """Answer `/api/walk`."""
        origin = self.headers.get("Origin", f"http://{self.server.host}")
        if self.headers.get("Host") != self.server.host or origin != f"http://{self.server.host}":
            return self.send(403, "only pages of this server may ask")
        given = self.headers.get("Authorization", "").encode()
        if not secrets.compare_digest(given, f"Bearer {self.server.token}".encode()):
            return self.send(401, "the token of the printed address is missing")
        if self.path != "/api/walk":
            return self.send(404, "there is /api/walk")
        try:
            length = int(self.headers.get("Content-Length", 0))
            if not 0 <= length <= LONGEST_BODY:
                return self.send(413, f"at most {LONGEST_BODY} bytes")
            body = json.loads(self.rfile.read(length))
            changes, models = body.get("set", {}), body.get("models", list(STAGES))
            if not isinstance(changes, Mapping) or not isinstance(models, list) or not {*models} <= STAGES.keys():
                raise TypeError
        except (ValueError, AttributeError, TypeError, RecursionError):
            return self.send(400, 'a question is JSON: {"set": {KEY: VALUE}, "models": ["rigid", "contact"]}')
        return self.send(*self.server.ask(replace(self.server.base, changes=changes, models=models)))

    def send(self, status: int, said: str | dict[str, Any]) -> None:
        """Send an object; a text is an error's message."""
        value = {"error": {"message": said}} if isinstance(said, str) else said
        body = json.dumps(value, allow_nan=False).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Nothing is said of single requests."""
