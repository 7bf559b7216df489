"""Runs of a stage or a sweep whose results are stored in folders, as on the command line."""

import itertools
import json
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, TypedDict, Unpack

from walkerlab.api.results import Result, Setting, dataset, optional_module, result_of
from walkerlab.config import files, schema
from walkerlab.config.analyses import Sweep as SweepBlock
from walkerlab.errors import ConfigError, NoAnswer, StaleError
from walkerlab.pipeline.plan import graph, planner, resolve
from walkerlab.pipeline.run.runner import Options, run_and_write
from walkerlab.pipeline.store import artifact, content
from walkerlab.pipeline.store.runs import RunFolder, config_of, run_named

if TYPE_CHECKING:
    from xarray import Dataset

RUNS = "runs"


class Combined(TypedDict, total=False):
    """Options for combining the values of a sweep's parameters. By default they form the full grid.

    zip     whether to combine the n-th values into the n-th point
    sample  how many points to draw from the intervals, and how (such as "sobol:64"), instead of using the grid
    seed    seed of the sampled points; by default from the config
    """

    zip: bool
    sample: str
    seed: int


@dataclass(frozen=True, repr=False)
class Run:
    """A folder of stored results.

    folder  the run's folder, with its path and its config file

    >>> _ = run("fixedpoint", runs=folder)
    >>> open_run("paper", folder).stages
    ('fixedpoint',)
    """

    folder: RunFolder

    def __repr__(self) -> str:
        return f"Run in {self.folder.path}: {', '.join((*self.stages, *self.sweeps)) or 'no results'}"

    @property
    def config(self) -> schema.Config:
        """Config that the results were computed with.

        Raises StaleError if it cannot be determined.
        """
        if (config := config_of(self.folder)) is None:
            raise StaleError(f"{self.folder.path} has no result with a readable config.")
        return config

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages with a stored result."""
        return tuple(name for name in graph.PIPELINE.names if self.folder.artifact(name).is_file())

    @property
    def sweeps(self) -> tuple[str, ...]:
        """Names of the stored sweeps, as arguments of `sweep`."""
        return tuple(sorted(path.stem for path in self.folder.path.glob("sweep-*.h5")))

    def result(self, stage: str) -> Result:
        """Return the stored result of a stage, even if it is out of date.

        stage  one of `stages`

        Raises StaleError if there is no readable result, ConfigError for an unknown stage.

        >>> _ = run("fixedpoint", runs=folder)
        >>> open_run("paper", folder).result("fixedpoint").stable
        True
        """
        check_stage(stage)
        stored = planner.result_in(self.folder, stage)
        message = stored.summary.get("no_answer")
        no_answer = None if message is None else NoAnswer(message["message"], message["advice"])
        return result_of(stage, stored.summary, stored, no_answer, self.folder.artifact(stage))

    def sweep(self, name: str = "") -> "Dataset":
        """Return a stored sweep as an xarray Dataset.

        name  one of `sweeps`; by default the only one

        Raises StaleError if it cannot be read, ConfigError if xarray is not installed.

        >>> _ = sweep("fixedpoint", {"slope_deg": [1, 3]}, runs=folder, jobs=1)
        >>> open_run("paper", folder).sweep().slope_deg.values.tolist()
        [1.0, 3.0]
        """
        names = self.sweeps
        if not name and len(names) != 1:
            raise StaleError(f"{self.folder.path} has {len(names)} sweeps: {', '.join(names) or 'none'}.")
        path = self.folder.path / f"{name or names[0]}.h5"
        try:
            return dataset(artifact.read(path)[""])
        except FileNotFoundError:
            raise StaleError(f"{self.folder.path} has no sweep {name}.", f"Choose from {', '.join(names)}.") from None
        except artifact.Damaged as error:
            raise StaleError(f"{path} is damaged: {error}.", "Run the same sweep again to rebuild it.") from error


def run(
    stage: str,
    config: str | Path = files.DEFAULT,
    set: Mapping[str, Setting] | None = None,
    runs: str | Path = RUNS,
    *,
    name: str | None = None,
    strides: int | None = None,
    force: bool = False,
    jobs: int = 1,
) -> Result:
    """Run a stage as `walkerlab STAGE` does: reuse up-to-date results, compute the others and store them.

    stage    name of the stage, such as "simulate"
    config   file, name of a built-in config, or name or folder of a run
    set      config keys to change, such as {"slope_deg": 3}
    runs     folder that holds all runs
    name     name of the run's folder; None derives it from the config and its changes
    strides  number of strides to walk; None keeps the config's number
    force    run the stage and all that it needs, even if their results are current
    jobs     maximum number of processes

    Returns the stored result. If the computation has no answer, `no_answer` has the reason. Raises ConfigError for an
    invalid config, StorageError if the result cannot be stored.

    >>> gait = run("fixedpoint", set={"slope_deg": 3}, runs=folder)
    >>> round(gait.summary["period_s"], 4)
    0.7343
    >>> float(gait.dataset("corrected/gaits").period_s.max()) == gait.summary["period_s"]
    True
    """
    check_stage(stage)
    resolved = resolve.resolve(str(config), set_options(set), strides, folder_of(runs), name)
    warn(resolved.loaded.warnings)
    report = run_and_write(resolved, stage, Options(force=force, jobs=jobs))
    return result_of(stage, report.as_json(), report.content or content.Content(), report.no_answer, report.artifact)


def open_run(name: str | Path, runs: str | Path = RUNS) -> Run:
    """Open a stored run by its name in the folder `runs`, or by the path of its folder.

    name  name of the run, or path of its folder
    runs  folder that holds all runs

    Returns the run, which reads its results when they are asked for. Raises ConfigError for an unknown run.

    >>> _ = run("fixedpoint", runs=folder)
    >>> open_run("paper", folder).result("fixedpoint").summary["stable"]
    True
    """
    return Run(run_named(str(name), folder_of(runs)))


def sweep(
    stage: str,
    over: Mapping[str, Sequence[Setting] | str],
    config: str | Path = files.DEFAULT,
    set: Mapping[str, Setting] | None = None,
    runs: str | Path = RUNS,
    *,
    name: str | None = None,
    engine: str = "local",
    jobs: int = 0,
    **combined: Unpack[Combined],
) -> "Dataset":
    """Run a sweep as `walkerlab sweep` does, and return all of its results as one xarray Dataset.

    stage     name of the stage to run at each point
    over      values of each config key to vary, as a list or "FROM:TO:N"
    config    file, name of a built-in config, or name or folder of a run
    set       config keys to change, such as {"slope_deg": 3}
    runs      folder that holds all runs
    name      name of the run's folder; None derives it from the config and its changes
    engine    where to compute: local, dask[=ADDRESS] or slurm
    jobs      number of chunks to compute in parallel; 0 lets the engine choose
    combined  zip, sample and seed, see `Combined`; by default the values form the full grid

    Returns a Dataset with a dimension for each key or, with zip or sample, with the single dimension `point`. Raises
    NoAnswer if points could not be computed, or WalkerlabError if a bug is among the reasons. The other points are
    stored, and `open_run` reads them.

    >>> gaits = sweep("fixedpoint", {"slope_deg": [1, 3]}, runs=folder, jobs=1)
    >>> [round(float(period), 4) for period in gaits.period_s]
    [0.7036, 0.7343]
    """
    from walkerlab.pipeline.sweeps.engines import EngineOptions, parse_engine
    from walkerlab.pipeline.sweeps.question import build_sweep
    from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork, modules_of

    optional_module("xarray", "a Dataset")  # fail before the sweep runs if xarray is missing
    resolved = resolve.resolve(str(config), set_options(set), runs=folder_of(runs), name=name)
    warn(resolved.loaded.warnings)
    if not isinstance(over, Mapping):
        raise ConfigError(f"over: {over!r} is not a mapping of keys to values.", 'For example {"slope_deg": [1, 2]}.')
    listed = [(key, sweep_values(key, value), f"over {key}") for key, value in over.items()]
    block = resolved.loaded.config.sweep or SweepBlock()
    if unknown := combined.keys() - Combined.__annotations__.keys():
        raise TypeError(f"sweep has no argument {min(unknown)!r}")
    seed = block.seed if combined.get("seed") is None else combined["seed"]
    question = build_sweep(stage, listed, combined.get("zip") or False, combined.get("sample") or "", seed)
    chosen, address = parse_engine(engine)
    modules = modules_of(stage, resolved.loaded.config, graph.PIPELINE)
    engine_options = EngineOptions(jobs, address, modules, resolved.folder.path)
    swept = SweepRun(question, resolved.loaded, resolved.folder).run(SweepWork(chosen, engine_options))
    if swept.failed:
        raise swept.error()
    return dataset(swept.content[""])


def warn(messages: Iterable[str], inside: int = 0) -> None:
    """Issue warnings that point at the line that called the API.

    inside  number of API functions between the user's code and the caller of `warn`
    """
    for text in messages:
        warnings.warn(text, stacklevel=3 + inside)


def set_options(values: Mapping[str, Setting] | None) -> list[str]:
    """Convert values of keys to `--set` options.

    Raises ConfigError if they are not a mapping.
    """
    if not isinstance(values, Mapping | NoneType):
        raise ConfigError(f"set: {values!r} is not a mapping of keys to values.", 'For example set={"slope_deg": 3}.')
    return [f"{key}={json.dumps(value)}" for key, value in (values or {}).items()]


def folder_of(runs: str | Path) -> Path:
    if not isinstance(runs, str | os.PathLike):
        raise ConfigError(f"runs: {runs!r} is not a folder.", 'For example runs="runs".')
    return Path(runs)


def sweep_values(key: str, values: Sequence[Setting] | str) -> str | list[Setting]:
    """Return the values of a sweep's parameter, or the text of a range.

    Raises ConfigError for anything else.
    """
    # Imported here, because few callers sweep.
    from walkerlab.pipeline.sweeps.question import MAX_POINTS

    if isinstance(values, str) and not values.lstrip().startswith("["):
        return values
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise ConfigError(
            f"over {key}: {values!r} is neither a list of values nor a range FROM:TO:N.",
            f'For example {{"{key}": [1, 2]}} or {{"{key}": "1:3:5"}}.',
        )
    return list(itertools.islice(values, MAX_POINTS + 1))  # an iterable may be endless


def check_stage(stage: str) -> None:
    if stage not in graph.PIPELINE.names:
        raise ConfigError(f"{stage}: unknown stage.", f"Choose from {', '.join(graph.PIPELINE.names)}.")
