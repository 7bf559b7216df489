"""The server of `walkerlab explore`: loopback only, protected by a token, with worker processes."""

import contextlib
import json
import os
import secrets
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from mimetypes import guess_type
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from walkerlab.errors import ConfigError
from walkerlab.pipeline.run.workers import Worker, WorkerDiedError
from walkerlab.views.explore import walks
from walkerlab.views.explore.jobs import Job
from walkerlab.views.explore.page import choices, render_page, start_name
from walkerlab.views.explore.walks import GIVE_WAY, SUPERSEDED, Answered, ExploredConfig

LONGEST_BODY = 100_000
NICE = 15


def failure(status: int, message: str, advice: str = "") -> Answered:
    return status, {"error": {"message": message, "advice": advice}}


class Desk:
    """A worker process that answers only the newest waiting request."""

    def __init__(self, drops: bool = False) -> None:
        """Start the worker. With `drops`, a new request cancels the one in progress."""
        self.drops = drops
        self.worker = self._hire()
        self._turn = threading.Lock()
        self._count = threading.Lock()
        self._newest = 0

    def _hire(self) -> Worker:
        worker = Worker(("walkerlab.views.explore.walks",))
        if self.drops:  # background work yields to other processes
            os.setpriority(os.PRIO_PROCESS, worker.process.pid, NICE)
        return worker

    def ask(self, call: Callable[[], Answered]) -> Answered:
        """Run the call in the worker once it is free, or return status 409 if a newer request arrived meanwhile.

        If the worker dies, a new one retries the call once, because the old one may have died while idle.
        """
        with self._count:
            self._newest += 1
            number = self._newest
        if self.drops and self._turn.locked():
            self.worker.process.send_signal(GIVE_WAY)
        with self._turn:
            deaths = 0
            # The call is repeated if the signal for an earlier request arrived late, or if the worker died while idle.
            while number == self._newest:
                try:
                    answer = self.worker.do(call)
                except WorkerDiedError as error:
                    self.worker = self._hire()
                    deaths += error.exit_code_of_worker != -GIVE_WAY  # the signal kills a worker without a handler yet
                    if deaths > 1:
                        return failure(500, error.message, error.advice)
                except Exception as error:
                    return failure(500, f"this is a bug in walkerlab: {type(error).__name__}: {error}")
                else:
                    if answer != SUPERSEDED:
                        return answer
            return SUPERSEDED

    def close(self) -> None:
        self.worker.process.kill()
        self.worker.ended()


class Server(ThreadingHTTPServer):
    """Answers requests about one config and the built-in ones."""

    daemon_threads = True

    def __init__(self, port: int, base: ExploredConfig) -> None:
        """Listen on `port`, or on a free one if it is 0."""
        super().__init__(("127.0.0.1", port), Handler)
        self.base = base
        self.token = secrets.token_urlsafe(16)
        self.job = Job()
        self.cookie = f"walkerlab-explore-{self.server_port}"
        # Curves plotted in the background must not delay the answer to a moved slider, so they have their own worker.
        self.desk = Desk()
        self.background = Desk(drops=True)
        self._thread: threading.Thread | None = None

    @property
    def host(self) -> str:
        """Host and port as a browser sends them in requests."""
        return f"127.0.0.1:{self.server_port}"

    @property
    def url(self) -> str:
        """Address of the page, including the token."""
        return f"http://{self.host}/?token={self.token}"

    def begin(self) -> None:
        """Serve from a background thread."""
        self._thread = threading.Thread(target=self.serve_forever, daemon=True)
        self._thread.start()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report errors, except those of closed connections."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="900" style="border: 0"></iframe>'

    def close(self) -> None:
        """End all computations and stop listening."""
        if self._thread is not None:
            self.shutdown()
        for part in (self.desk, self.background, self.job):
            part.close()
        self.server_close()

    def question(self, body: Mapping[str, Any]) -> ExploredConfig:
        """Read the requested config from a request body.

        Raises TypeError if the body is malformed.
        """
        known = walks.WALK_STAGES.keys()
        changes = body.get("set", {})
        models = body.get("models", list(known))
        if not isinstance(changes, Mapping) or not isinstance(models, list) or not {*models} <= known:
            raise TypeError
        question = replace(self.base, changes=changes, models=models)
        config_name = body.get("config")
        if config_name is None or config_name == start_name(self.base):
            return question
        if config_name not in choices(self.base):
            raise TypeError
        return replace(question, config=config_name, sets=())

    def answer(self, path: str, body: Mapping[str, Any]) -> Answered:
        """Answer a POST request.

        Raises TypeError if its body is malformed.
        """
        question = self.question(body)
        if path == "/api/walk":
            return self.desk.ask(partial(walks.walk, question))
        if path == "/api/numbers":
            return walks.numbers(question)
        if path == "/api/along":
            return self.background.ask(partial(walks.follow_gaits, question))
        if path == "/api/save":
            return save(question, body.get("name"))
        if path == "/api/job":
            return self.job.begin(body.get("kind"), question)
        return failure(404, f"not found: {path}")


def save(question: ExploredConfig, name: Any) -> Answered:
    """Save the config in the working folder, and never overwrite a file."""
    if not isinstance(name, str) or not name or Path(name).name != name:
        return failure(400, "give a file name without folders, such as mine.yaml")
    path = Path(name).with_suffix(".yaml")
    try:
        text = walks.config_text(question, path.stem)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except ConfigError as error:
        return question.refusal(error)
    except FileExistsError:
        return failure(409, f"{path} already exists.", "Choose another name; files are never overwritten.")
    except OSError as error:
        return failure(500, f"{path} cannot be written: {error.strerror}.")
    return 200, {"file": str(path.resolve()), "text": text}


class Handler(BaseHTTPRequestHandler):
    """Handles one HTTP request."""

    server: Server
    timeout = 60

    def do_GET(self) -> None:
        """Send the page, the progress of a job, or a file that a job made."""
        try:
            address = urlsplit(self.path)
            url_token = parse_qs(address.query).get("token", [""])[0]
            if not self.local() or not self.allowed(url_token or self.cookie() or self.bearer()):
                return None
            if address.path == "/":
                html, policy = render_page(self.server.base)
                return self.send(200, html.encode(), "text/html; charset=utf-8", policy)
            if address.path == "/api/job":
                return self.answer(200, self.server.job.progress())
            runs = self.server.base.runs.resolve()
            file = (runs / unquote(address.path).removeprefix("/runs/")).resolve()
            if address.path.startswith("/runs/") and file.is_relative_to(runs) and file.is_file():
                return self.send(200, file.read_bytes(), guess_type(file.name)[0] or "application/octet-stream")
        except (ValueError, OSError, RuntimeError):  # malformed address, unreadable file, or loop of links
            pass
        return self.answer(*failure(404, f"not found: {self.path}"))

    def do_POST(self) -> None:
        if not self.local() or not self.allowed(self.bearer()):
            return None
        try:
            length = int(self.headers.get("Content-Length", 0))
            if not 0 <= length <= LONGEST_BODY:
                return self.answer(*failure(413, f"a request has at most {LONGEST_BODY} bytes"))
            self.answer(*self.server.answer(urlsplit(self.path).path, json.loads(self.rfile.read(length))))
        except (ValueError, AttributeError, TypeError, RecursionError):
            form = '{"set": {KEY: VALUE}, "models": ["rigid", "contact"]}'
            self.answer(*failure(400, f"a request is JSON: {form}; `config`, if given, must be one of the page's"))

    def local(self) -> bool:
        """Whether the request comes from this server's own page. Otherwise send status 403."""
        own = f"http://{self.server.host}"
        if self.headers.get("Host") == self.server.host and self.headers.get("Origin", own) == own:
            return True
        self.answer(*failure(403, "only this server's own page may send requests"))
        return False

    def cookie(self) -> str:
        """Return the token from this server's cookie. Its name contains the port, so that servers do not share it."""
        parts = dict(part.partition("=")[::2] for part in self.headers.get("Cookie", "").split("; "))
        return parts.get(self.server.cookie, "")

    def bearer(self) -> str:
        return self.headers.get("Authorization", "").removeprefix("Bearer ")

    def allowed(self, token: str) -> bool:
        """Whether the token is right. If it is wrong, send status 401."""
        if secrets.compare_digest(token.encode(), self.server.token.encode()):
            return True
        self.answer(*failure(401, "the token is missing", "Open the address as it was printed."))
        return False

    def answer(self, status: int, value: Mapping[str, Any]) -> None:
        self.send(status, json.dumps(value, allow_nan=False).encode(), "application/json")

    def send(self, status: int, body: bytes, kind: str, policy: str = "") -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store"}
        if status == 200 and "text/html" in kind:
            # Links between the pages of a report carry no token.
            headers["Set-Cookie"] = f"{self.server.cookie}={self.server.token}; HttpOnly; SameSite=Strict"
        if policy:
            headers["Content-Security-Policy"] = policy
        for name, value in headers.items():
            self.send_header(name, value)
        with contextlib.suppress(ConnectionError):  # the page may have been closed
            self.end_headers()
            self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Do not log requests."""
