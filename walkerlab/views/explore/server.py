"""The server of `walkerlab explore`. It listens only to this machine, requires a token, and computes in worker
processes.

Background jobs write a report or a GIF into the runs folder. The page has the player and the style of the report, and a
script that sends requests to the server.
"""

import contextlib
import json
import os
import re
import secrets
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from mimetypes import guess_type
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote, unquote, urlsplit

from jinja2 import FileSystemLoader
from markupsafe import Markup

from walkerlab.config.files import DEFAULT, builtin_names
from walkerlab.errors import ConfigError
from walkerlab.pipeline.run.workers import STORING_PATIENCE_S, Worker, WorkerDiedError
from walkerlab.views.explore import walks
from walkerlab.views.explore.walks import GIVE_WAY, SUPERSEDED, Answered, ExploredConfig
from walkerlab.views.report import page as report
from walkerlab.views.report.blocks import Player

KINDS = ("report", "gif")
EARLY_PAGE = re.compile(r"page: (.+) \(partial")
"""Progress line that announces a partial page."""
JOB_PROGRAM = (
    "from walkerlab.pipeline.run.workers import end_with_parent; end_with_parent(); "
    "from walkerlab.views.cli.main import main; main()"
)
"""Program that runs a command like `python -m walkerlab`, and ends when the server ends."""


class Job:
    """Runs one job at a time, as the command that a user would type."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._runs = Path()
        self._lock = threading.Lock()
        # Latest progress message and, once the report or animation exists, its address. The dictionary is replaced,
        # never modified.
        self.status: dict[str, Any] = {"running": False}

    def begin(self, kind: object, question: ExploredConfig) -> Answered:
        """Start a job, or return status 409 while another one runs."""
        if kind not in KINDS:
            raise TypeError
        with self._lock:
            if self.status["running"]:
                return 409, {"error": {"message": "another export is running", "advice": "Wait until it has finished."}}
            self.status = {"running": True, "kind": kind, "progress": ""}
        threading.Thread(target=self._make, args=(str(kind), question), daemon=True).start()
        return 200, self.status

    def close(self) -> None:
        """End the running job and its child processes."""
        if (process := self._process) is not None:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(STORING_PATIENCE_S)
            with contextlib.suppress(ProcessLookupError):
                # The command leads a session of its own, so this also ends the workers that it has started.
                os.killpg(process.pid, signal.SIGKILL)

    def _make(self, kind: str, question: ExploredConfig) -> None:
        self._runs = runs = question.runs.resolve()
        of_config = [*question.options, "--runs", str(runs), "--json"]
        try:
            if kind == "report":
                answer = self._command("report", *of_config)
                file = Path(answer["run_dir"]) / answer["html"]
            else:
                walk = "simulate" if question.models == ["rigid"] else "contact-sim"
                folder = Path(self._command(walk, *of_config)["run_dir"])
                file = folder / f"{walk}.gif"
                self._command("animate", str(folder), "--model", walk, "--to", "gif", "-o", str(file))
            self.status = {"running": False, "kind": kind, "url": self._url(file)}
        except (RuntimeError, OSError, KeyError, ValueError) as error:
            self.status = {"running": False, "kind": kind, "error": {"message": str(error), "advice": ""}}

    def _url(self, file: Path) -> str:
        return "/runs/" + quote(str(file.resolve().relative_to(self._runs)))

    def _command(self, *words: str) -> dict[str, Any]:
        """Run a command and return its JSON output.

        Raises RuntimeError with its last message if it fails.
        """
        # With -P, Python imports no modules from the working folder in place of the real ones.
        command = [sys.executable, "-P", "-c", JOB_PROGRAM, *words]
        lines = []
        # The output goes to a file, because a pipe would fill up while only stderr is read.
        with tempfile.TemporaryFile("w+") as output:
            with subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=output, stderr=subprocess.PIPE, text=True, start_new_session=True
            ) as self._process:
                assert self._process.stderr is not None
                for line in self._process.stderr:
                    lines.append(line.strip())
                    self.status = {**self.status, "progress": line.strip()}
                    if (early := EARLY_PAGE.search(line)) is not None:
                        self.status = {**self.status, "url": self._url(Path(early[1]))}
                status = self._process.wait()
            output.seek(0)
            printed = output.read()
        if status != 0:
            raise RuntimeError(next((line for line in lines if line.startswith("error:")), "\n".join(lines[-2:])))
        with contextlib.suppress(json.JSONDecodeError):
            answer: dict[str, Any] = json.loads(printed)
            return answer
        return {}


TEMPLATES = Path(__file__).parent / "templates"
PLAYER_CAPTION = (
    "Wide outline: rigid model; narrow: contact model. Each leg is a line from hip to foot;"
    " leg 2 is hollow. Arrows are ground forces; a red arrow is a push-off."
)


MAX_NAME_CHARACTERS = 60


def start_name(base: ExploredConfig) -> str:
    name = base.called or base.config or DEFAULT
    changed = f"{name} with {', '.join(base.sets)}"
    return (
        name if base.called or not base.sets else changed if len(changed) <= MAX_NAME_CHARACTERS else f"{name}, changed"
    )


def choices(base: ExploredConfig) -> list[str]:
    """List the other configs to choose from: built-in ones, and the YAML files in the working folder."""
    files = sorted(path.name for path in Path().glob("*.yaml"))
    return [name for name in (*builtin_names(), *files) if name != start_name(base)]


def render_page(base: ExploredConfig) -> tuple[str, str]:
    """Return the page's HTML and its content security policy."""
    explore_script = (TEMPLATES / "explore.js").read_text(encoding="utf-8").strip()
    script = f'\n"use strict";\n{report.source("player.js")}\n{explore_script}\n'
    environment = report.environment()
    environment.loader = FileSystemLoader([report.TEMPLATE_FOLDER, TEMPLATES])
    html = environment.get_template("explore.html.j2").render(
        start_name=start_name(base),
        configs=choices(base),
        anchor="walk",
        # An empty player, which the script fills.
        block=Player(
            title="The walk.",
            caption=PLAYER_CAPTION,
            alt="The walker",
            walkers=(),
            slope_rad=0.0,
            leg_m=1.0,
            foot_radii_m=(0.0, 0.0),
            closeup_m=1.0,
            view=(0, 0, 1, 1),
        ),
        # Only files of this package count as markup. All other texts are escaped.
        style=Markup(report.source("style.css") + (TEMPLATES / "explore.css").read_text(encoding="utf-8")),
        script=Markup(script),
    )
    allowed = "default-src 'none'; img-src data: blob:; connect-src 'self'; style-src 'unsafe-inline'"
    return html, f"{allowed}; script-src 'sha256-{report.digest_of(script)}'; base-uri 'none'; form-action 'none'"


LONGEST_BODY = 100_000
NICENESS = 15


def failure(status: int, message: str, advice: str = "") -> Answered:
    return status, {"error": {"message": message, "advice": advice}}


class Desk:
    """A worker process that answers only the newest waiting request."""

    def __init__(self, drops: bool = False) -> None:
        """Start the worker. If `drops` is true, a new request cancels the one in progress."""
        self.drops = drops
        self.worker = self._hire()
        self._turn = threading.Lock()
        self._count = threading.Lock()
        self._newest = 0

    def _hire(self) -> Worker:
        worker = Worker(("walkerlab.views.explore.walks",))
        if self.drops:  # work in the background gives way to other processes
            os.setpriority(os.PRIO_PROCESS, worker.process.pid, NICENESS)
        return worker

    def ask(self, call: Callable[[], Answered]) -> Answered:
        """Run the call in the worker once it is free, or return status 409 if a newer request arrived meanwhile.

        If the worker dies, a new one retries the call once, because the old one may have died while idle.
        """
        with self._count:
            self._newest += 1
            number = self._newest
        # The worker is busy with an earlier request that nobody is waiting for any more.
        if self.drops and self._turn.locked():
            self.worker.process.send_signal(GIVE_WAY)
        with self._turn:
            deaths = 0
            # The call is repeated if the signal to drop an earlier request arrived late, or if the worker died while
            # idle.
            while number == self._newest:
                try:
                    answer = self.worker.do(call)
                except WorkerDiedError as error:
                    self.worker = self._hire()
                    # The signal to drop a request kills a worker that has no handler yet. That is not the call's fault.
                    deaths += error.exit_code_of_worker != -GIVE_WAY
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
        self.worker.wait_for_end()


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
        # Curves are computed in the background by another worker, so that they do not delay the answer to a moved
        # slider.
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
            if not self.check_origin() or not self.check_token(url_token or self.cookie() or self.bearer()):
                return None
            if address.path == "/":
                html, policy = render_page(self.server.base)
                return self.send(200, html.encode(), "text/html; charset=utf-8", policy)
            if address.path == "/api/job":
                return self.answer(200, self.server.job.status)
            runs = self.server.base.runs.resolve()
            file = (runs / unquote(address.path).removeprefix("/runs/")).resolve()
            if address.path.startswith("/runs/") and file.is_relative_to(runs) and file.is_file():
                return self.send(200, file.read_bytes(), guess_type(file.name)[0] or "application/octet-stream")
        except (ValueError, OSError, RuntimeError):  # malformed address, unreadable file, or loop of links
            pass
        return self.answer(*failure(404, f"not found: {self.path}"))

    def do_POST(self) -> None:
        if not self.check_origin() or not self.check_token(self.bearer()):
            return None
        try:
            length = int(self.headers.get("Content-Length", 0))
            if not 0 <= length <= LONGEST_BODY:
                return self.answer(*failure(413, f"a request has at most {LONGEST_BODY} bytes"))
            self.answer(*self.server.answer(urlsplit(self.path).path, json.loads(self.rfile.read(length))))
        except (ValueError, AttributeError, TypeError, RecursionError):
            form = '{"set": {KEY: VALUE}, "models": ["rigid", "contact"]}'
            self.answer(*failure(400, f"a request is JSON: {form}; `config`, if given, must be one of the page's"))

    def check_origin(self) -> bool:
        """Return whether this server's page sent the request. If not, answer with status 403."""
        origin = f"http://{self.server.host}"
        # A page of another site can also send requests to this machine, but cannot change these headers.
        if self.headers.get("Host") == self.server.host and self.headers.get("Origin", origin) == origin:
            return True
        self.answer(*failure(403, "only this server's own page may send requests"))
        return False

    def cookie(self) -> str:
        """Return the token from this server's cookie. Its name contains the port, so that servers do not share it."""
        parts = dict(part.partition("=")[::2] for part in self.headers.get("Cookie", "").split("; "))
        return parts.get(self.server.cookie, "")

    def bearer(self) -> str:
        return self.headers.get("Authorization", "").removeprefix("Bearer ")

    def check_token(self, token: str) -> bool:
        """Return whether a token is right. If not, answer with status 401."""
        # An ordinary comparison takes longer if more characters are right, which would help to guess the token.
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
            # The cookie is needed because links between the pages of a report have no token.
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
