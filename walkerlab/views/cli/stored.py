"""Commands on stored results: `status`, `show`, `clean` and `rerun`."""

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from walkerlab.config.files import ConfigFile
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.plan.planner import RunSummary, runs_in, survey
from walkerlab.pipeline.plan.results import UP_TO_DATE, Step
from walkerlab.pipeline.run import executor, runner
from walkerlab.pipeline.store import artifact, content, runs
from walkerlab.views.cli.request import Request, print_result
from walkerlab.views.report.tables import aligned, describe_summary

DIGEST_CHARACTERS = 12
"""Number of characters of a digest that text output shows."""
NOT_CURRENT = ("stale", "missing", "damaged")


def print_status(request: Request, check: bool, run: str | None) -> None:
    """Print the state of each stage, and of all runs unless one was selected.

    run  name or folder of a run, compared with the config stored in its results; None for the request's run
    Raises ConfigError for an unknown run, and StaleError if its config is unreadable. With `check`, raises
    typer.Exit(5) for a stale, missing or damaged result.
    """
    folder = request.folder if run is None else runs.run_named(run, request.runs)
    config = request.resolved if run is None else runs.config_of(folder)
    if config is None:
        raise StaleError(f"{folder.path} has no result with a readable config.", "`walkerlab status` lists all runs.")
    is_selected = run is not None or request.config is not None or request.settings or request.strides is not None
    listed = None if is_selected else list(runs_in(request.runs, request.graph))
    steps = survey(config, folder, request.graph)
    error = check_error(steps, request.graph.stages[-1].name)
    rows = [
        {
            "stage": step.stage.name,
            "state": state_of(step),
            "why": step.reason,
            "artifact": str(folder.artifact(step.stage.name)) if step.found is not None else None,
        }
        for step in steps
    ]
    folders = [folder] if listed is None else [*map(runs.RunFolder.open_folder, sorted(request.runs.glob("*/")))]
    working = {place.path: worker for place in folders if (worker := place.worker()) is not None}
    status: dict[str, Any] = {
        "run_dir": str(folder.path),
        "changes": list(folder.changes),
        "running": [{"run_dir": str(path), **asdict(worker)} for path, worker in working.items()],
        "current": error is None,
        "stages": rows,
    }
    texts = zip((step.stage.name for step in steps), map(state_of, steps), explain_states(steps), strict=True)
    table = aligned([["stage", "state", "why"], *map(list, texts)])
    changed = [f"changed: {', '.join(folder.changes)}"] if folder.changes else []
    running = [f"running in {path}: {worker}" for path, worker in working.items()]
    lines = [*running, f"{folder.path}:", *changed, *table]
    if listed is not None:
        status["runs"] = [vars(run_summary) | {"run_dir": str(run_summary.run_dir)} for run_summary in listed]
    if listed:
        head = ["run", "results", "up to date", "sweeps", "size", "last written", "changed"]
        lines += ["", f"all runs in {request.runs}:", *aligned([head, *map(row_of, listed)])]
    print_result(request, status, lines, error if check else None)


def row_of(run: RunSummary) -> list[str]:
    unknown = "unknown config" if run.stages else "0"
    current = unknown if run.current is None else str(len([s for s in run.stages if s in run.current]))
    counts = [str(len(run.stages)), current, str(len(run.sweeps))]
    return [run.name, *counts, f"{run.bytes / 1e6:.1f} MB", run.changed_utc, ", ".join(run.changes)]


def state_of(step: Step) -> str:
    if step.action == "leave out":
        return "left out"
    if step.action == "reuse":
        return "current" if step.found is not None and step.found.complete else "no answer"
    if step.damaged:
        return "damaged"
    if step.stage.only_by:
        return "not run" if step.found is None else "outdated"
    return "missing" if step.found is None else "stale"


def explain_states(steps: Sequence[Step]) -> Iterator[str]:
    """Explain the state of each stage's result, or yield '' if that needs no explanation.

    If several stages have the same reason, all but the first refer to the first.
    """
    first: dict[str, str] = {}
    for step in steps:
        is_obvious = step.reason in (artifact.NOT_THERE, UP_TO_DATE)
        reason = "" if is_obvious else step.reason.removeprefix(f"{state_of(step)}: ")
        reason = executor.short_reason(reason) if step.action == "leave out" else reason
        yield f"as {first[reason]}" if reason in first else reason
        if reason:
            first.setdefault(reason, step.stage.name)


def check_error(steps: tuple[Step, ...], last: str) -> StaleError | None:
    """Return the error for `--check`, or None if every result is current."""
    counts = Counter(state for step in steps if (state := state_of(step)) in NOT_CURRENT)
    if not counts:
        return None
    counted_states = ", ".join(f"{number} {state}" for state, number in counts.items())
    return StaleError(f"not every result is up to date: {counted_states}.", f"`walkerlab {last}` computes them all.")


def print_stored(request: Request, stage: str) -> None:
    """Print a stage's artifact, even if it is out of date.

    Raises ConfigError if there is no run, StaleError if the artifact cannot be read.
    """
    path = request.folder.artifact(stage)
    step = next(step for step in survey(request.resolved, request.folder, request.graph) if step.stage.name == stage)
    if not request.folder.path.is_dir():
        raise ConfigError(f"there is no run at {request.folder.path}.", f"`walkerlab {stage}` creates it.")
    if not isinstance(step.found, artifact.Stored):
        reason = "it does not exist yet" if step.reason == artifact.NOT_THERE else step.reason
        raise StaleError(f"{path} cannot be shown: {reason}.", f"`walkerlab {stage}` computes it.")
    if step.action != "reuse":
        request.console.warn(f"{path} is out of date: {step.reason}")
    about = {"stage": stage, "artifact": str(path), "current": step.action == "reuse", "why": step.reason}
    print_result(request, about | as_json(step.found), [f"{stage}: {path}", *lines(step.found)])


def as_json(stored: artifact.Stored) -> dict[str, Any]:
    """Describe an artifact as JSON, without the values of its arrays."""

    def labels(variable: content.Variable) -> dict[str, Any]:
        shape = list(variable.values.shape)
        return {
            "dims": list(variable.dims), "shape": shape, "units": variable.units, "long_name": variable.long_name
        }  # fmt: skip

    return {
        "complete": stored.complete,
        "summary": stored.summary,
        "groups": {
            path: {"attrs": dict(group.attrs), "variables": {n: labels(v) for n, v in group.variables.items()}}
            for path, group in stored.groups.items()
        },
        "key": stored.identity.key,
        "input_keys": dict(stored.identity.input_keys),
        "code_digest": stored.identity.code_digest,
        "content_digest": stored.digest(),
        "provenance": asdict(stored.provenance),
    }


def lines(stored: artifact.Stored) -> list[str]:
    """Describe an artifact in lines: summary, arrays and provenance."""
    result = ["summary", *describe_summary(stored.summary)]
    for path, group in stored.groups.items():
        result.append(path)
        result += [f"  {line}" for line in describe_summary(group.attrs)]
        result += [f"  {line}" for line in aligned([row(name, variable) for name, variable in group.variables.items()])]
    where = stored.provenance
    versions = {"walkerlab": where.package_version, **where.library_versions}
    facts = {
        "key": stored.identity.key[:DIGEST_CHARACTERS],
        "content": stored.digest()[:DIGEST_CHARACTERS],
        "made": f"{where.started_utc} to {where.ended_utc}",
        "command": where.command_line,
        "commit": where.git_commit,
        "platform": where.platform,
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
    }
    return [*result, "provenance", *describe_summary(facts)]


def row(name: str, variable: content.Variable) -> list[str]:
    sizes = ", ".join(f"{dim} {size}" for dim, size in zip(variable.dims, variable.values.shape, strict=True))
    return [name, f"({sizes})", variable.units, variable.long_name]


def clean_folders(request: Request, every: bool, stages: Sequence[str], yes: bool) -> None:
    """Delete the files of one run or, if `every` is true, of all runs, and remove folders that become empty.

    The user has to confirm this unless `yes` is true.
    Raises typer.BadParameter if there is no terminal for the question, StorageError if a file cannot be removed, and,
    with `--no-wait`, LockedError while another process works in a folder.
    """
    if every:
        names = sorted(path.name for path in request.runs.iterdir() if path.is_dir()) if request.runs.is_dir() else []
        folders = [runs.RunFolder(request.runs, name) for name in names]
    else:
        folders = [request.folder]
    files_by_folder = {folder: runs.files_of(folder, stages) for folder in folders}
    files = [path for paths in files_by_folder.values() for path in paths]
    sizes = {path: path.lstat().st_size for path in files}
    where = folders[0].path if len(folders) == 1 else request.runs
    if files and not (yes or request.dry_run):
        if not sys.stdin.isatty():
            raise typer.BadParameter("cannot ask for confirmation without a terminal; give --yes", param_hint="--yes")
        if not typer.confirm(f"Remove {len(files)} files from {where}?", err=True):
            files_by_folder = {}
            files = []
    if not request.dry_run:
        for folder, paths in files_by_folder.items():
            if paths:
                with folder.locked(not request.no_wait, request.console.note):
                    runs.remove(folder, paths)
                runs.remove_if_empty(folder)
    verb = "would be removed" if request.dry_run else "removed"
    lines = [f"{verb}: {line}" for line in file_lines(files, sizes)] or [f"{where}: nothing {verb}"]
    print_result(request, {"run_dir": str(where), "removed": [*map(str, files)], "dry_run": request.dry_run}, lines)


def file_lines(files: Sequence[Path], sizes: Mapping[Path, int]) -> list[str]:
    """Return a line for each file, but only one line for all figures of a run and for all chunks of a sweep."""
    lines: dict[str, list[Path]] = {}
    for path in files:
        patterns = {runs.CHUNKS: f"{path.stem.rpartition('-')[0]}-*", runs.FIGURES_FOLDER: "*"}
        lines.setdefault(str(path.parent / patterns.get(path.parent.name, path.name)), []).append(path)
    return [
        line if len(paths) == 1 else f"{line} ({len(paths)} files, {sum(sizes[path] for path in paths) / 1e6:.1f} MB)"
        for line, paths in lines.items()
    ]


def rerun_artifact(path: Path, request: Request) -> None:
    """Recompute an artifact in an empty folder, and print whether the result is the same.

    Raises ConfigError if the artifact is missing, StaleError if it is damaged or not reproduced.
    """
    try:
        stored = artifact.read(path)
    except (FileNotFoundError, NotADirectoryError):
        raise ConfigError(f"there is no artifact {path}.", "`walkerlab status` lists a run's artifacts.") from None
    except artifact.Damaged as error:
        advice = f"`walkerlab {path.stem} -c {runs.RunFolder.open_folder(path.parent).quoted_path}` recomputes it."
        raise StaleError(f"{path} is damaged: {error}.", advice) from None
    stage = stored.identity.stage
    name = path.resolve().parent.name
    config = load(ConfigFile(Path(name), str(path), stored.provenance.config)).config
    with tempfile.TemporaryDirectory(prefix="walkerlab-rerun-") as scratch:
        folder = runs.RunFolder(Path(scratch), name)
        recomputed = runner.execute(config, stage, folder, reporter=request.console, graph=request.graph).content
    before = stored.digest()
    after = None if recomputed is None else recomputed.digest()
    same_code = recomputed is not None and recomputed.identity.key == stored.identity.key
    value = {
        "stage": stage,
        "artifact": str(path),
        "same": before == after,
        "digest": before,
        "digest_again": after,
        "same_code": same_code,
    }
    if before == after:
        print_result(request, value, [f"{path} is reproduced bit for bit: content {before[:DIGEST_CHARACTERS]}."])
        return
    reason = "the code is the same" if same_code else "the code has changed since"
    another = StaleError(
        f"{path} is not reproduced: its content digest was {before[:DIGEST_CHARACTERS]} "
        f"and is now {(after or 'missing')[:DIGEST_CHARACTERS]}; {reason}.",
        "Results agree bit for bit only on the same platform with the same versions; `walkerlab show` lists both.",
    )
    print_result(request, value, [], another)
