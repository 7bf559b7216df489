"""Background jobs that write a report or a GIF of the current config into the runs folder."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any
from urllib.parse import quote

from walkerlab.pipeline.run.interrupts import STORING_PATIENCE_S
from walkerlab.views.explore.walks import Answered, ExploredConfig

KINDS = ("report", "gif")
EARLY_PAGE = re.compile(r"page: (.+) \(partial")
"""Progress line that announces a partial page."""
JOB_PROGRAM = (
    "from walkerlab.pipeline.run.interrupts import end_with_parent; end_with_parent(); "
    "from walkerlab.views.cli.main import main; main()"
)
"""Program that runs a command as `python -m walkerlab` does, and ends when the server ends."""


class Job:
    """Runs one job at a time, as the command that a user would type."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._runs = Path()
        self._lock = threading.Lock()
        self._status: dict[str, Any] = {"running": False}

    def begin(self, kind: object, question: ExploredConfig) -> Answered:
        """Start a job, or return status 409 while another one runs."""
        if kind not in KINDS:
            raise TypeError
        with self._lock:
            if self._status["running"]:
                return 409, {"error": {"message": "another export is running", "advice": "Wait until it has finished."}}
            self._status = {"running": True, "kind": kind, "progress": ""}
        threading.Thread(target=self._make, args=(str(kind), question), daemon=True).start()
        return 200, dict(self._status)

    def progress(self) -> dict[str, Any]:
        """Return the latest progress message and, as soon as the file exists, its address."""
        return dict(self._status)

    def close(self) -> None:
        """End the running job and its child processes."""
        if (process := self._process) is not None:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(STORING_PATIENCE_S)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)

    def _make(self, kind: str, question: ExploredConfig) -> None:
        self._runs = runs = question.runs.resolve()
        of_config = [*question.options, "--runs", str(runs), "--json"]
        try:
            if kind == "report":
                made = self._command("report", *of_config)
                file = Path(made["run_dir"]) / made["html"]
            else:
                walk = "simulate" if question.models == ["rigid"] else "contact-sim"
                folder = Path(self._command(walk, *of_config)["run_dir"])
                file = folder / f"{walk}.gif"
                self._command("animate", str(folder), "--model", walk, "--to", "gif", "-o", str(file))
            self._status = {"running": False, "kind": kind, "url": self._url(file)}
        except (RuntimeError, OSError, KeyError, ValueError) as error:
            self._status = {"running": False, "kind": kind, "error": {"message": str(error), "advice": ""}}

    def _url(self, file: Path) -> str:
        return "/runs/" + quote(str(file.resolve().relative_to(self._runs)))

    def _command(self, *words: str) -> dict[str, Any]:
        """Run a command and return its JSON output.

        Raises RuntimeError with its last message if it fails.
        """
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
                    self._status = {**self._status, "progress": line.strip()}
                    if (early := EARLY_PAGE.search(line)) is not None:
                        self._status = {**self._status, "url": self._url(Path(early[1]))}
                status = self._process.wait()
            output.seek(0)
            printed = output.read()
        if status != 0:
            raise RuntimeError(next((line for line in lines if line.startswith("error:")), "\n".join(lines[-2:])))
        with contextlib.suppress(json.JSONDecodeError):
            found: dict[str, Any] = json.loads(printed)
            return found
        return {}
