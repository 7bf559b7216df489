"""Python interface: runs in folders, like those of the command line, or in memory."""

import itertools
import json
import math
import os
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, cast

from markupsafe import escape

from walkerlab.config.contact import Contact
from walkerlab.config.fields import Block, block_of, kinds_of
from walkerlab.config.files import DEFAULT, builtin_config, read_layers
from walkerlab.config.layers import merge_layers
from walkerlab.config.loader import suspicious_values
from walkerlab.config.overlay import tree_of
from walkerlab.config.problems import suggestion
from walkerlab.config.schema import Config
from walkerlab.config.sweep import Sweep as SweepBlock
from walkerlab.config.tree import NOWHERE
from walkerlab.config.validation import align_start, validate_tree
from walkerlab.config.walkers import CompassWalker, Kneed, Walker
from walkerlab.errors import ConfigError, NoAnswer, StaleError
from walkerlab.extensions import check_names
from walkerlab.pipeline.headlines import headline_values
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.resolve import resolve
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.plan.survey import result_in
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.run.runner import Options, run_and_write
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged, Identified
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.store.csv_text import csv_text
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.pipeline.store.runs import config_of, run_named
from walkerlab.views.report.text import in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from walkerlab.views.figures.illustration import Illustration

check_names(warnings.warn)
RUNS = "runs"
MADE_HERE: dict[str, tuple[tuple[type[Block], ...], str]] = {
    "walker": (
        tuple(kinds_of(Config.model_fields["walker"]).values()),
        "walkerlab.compass(), kneed() and walker(type) make one.",
    ),
    "contact": ((Contact,), "walkerlab.contact() makes one."),
}
"""Allowed types of arguments that are config blocks, and advice on how to build a block."""


class Combined(TypedDict, total=False):
    """Options for combining the values of a sweep's parameters; by default they form the full grid.

    zip     whether to combine the n-th values into the n-th point
    sample  how to draw points from the intervals, and how many, instead of using the grid, such as "sobol:64"
    seed    seed of the sampled points; by default from the config
    """

    zip: bool
    sample: str
    seed: int | None


@dataclass(frozen=True, repr=False)
class Result:
    """Result of a stage; its repr shows the headline values, and notebooks show its answer with tables.

    Each value of the summary is also an attribute and an item.

    stage      name of the stage
    summary    values that `--json` prints, in SI units
    content    all labelled arrays, by group
    no_answer  reason if there is no answer, otherwise None
    artifact   file of the result; None if it was computed in memory

    >>> gait = find_gait()
    >>> gait.period_s == gait["period_s"] == gait.summary["period_s"]
    True
    >>> gait.periods
    Traceback (most recent call last):
    ...
    AttributeError: Gait of fixedpoint has no value 'periods'. Did you mean period_s?
    """

    stage: str
    summary: Mapping[str, Any]
    content: Content
    no_answer: str | None = None
    artifact: Path | None = None

    def __getattr__(self, name: str) -> Any:
        # Python asks for attributes such as __deepcopy__ before there is a summary.
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        if name in self._values:
            return self._values[name]
        raise AttributeError(
            f"{type(self).__name__} has no attribute {name!r}" if name[:1] == "_" else self._describe_missing(name)
        )

    def __getitem__(self, name: str) -> Any:
        if name not in self._values:
            raise KeyError(self._describe_missing(name))
        return self._values[name]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *filter(str.isidentifier, self._values)})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._values)

    @property
    def _values(self) -> Mapping[str, Any]:
        return {**headline_values(self.stage, self.summary), **self.summary}

    def _describe_missing(self, name: str) -> str:
        """Explain why there is no value of this name, and where there is one."""
        start = f"{type(self).__name__} of {self.stage} has no value {name!r}"
        if self.no_answer is not None:
            return f"{start}: {self.no_answer}."
        holders = [group for group in self.groups if name in self.content[group].variables]
        if holders:
            return f"{start}, but an array: dataset({holders[0]!r}).{name}"
        names = ", ".join(headline_values(self.stage, self.summary))
        return f"{start}.{suggestion(name, self._values) or f' It has {names} and more in `summary` and `groups`.'}"

    def __repr__(self) -> str:
        values = headline_values(self.stage, self.summary)
        lines = [f"no answer: {self.no_answer}"] if self.no_answer is not None else []
        lines += [f"  {name:<{max(map(len, values))}}  {in_words(value)}" for name, value in values.items()]
        lines += [f"groups: {', '.join(self.groups)}"] if self.groups else []
        return "\n".join([f"{type(self).__name__} of {self.stage}", *lines])

    def _repr_html_(self) -> str:
        # Imported here: only notebooks show HTML.
        from walkerlab.views.report.answers import answer_html

        if self.no_answer is not None:
            return f"<p>No answer: {escape(self.no_answer)}</p>"
        return answer_html(self.stage, self.summary)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of arrays, as arguments of `dataset`."""
        return tuple(path for path, group in self.content.groups.items() if group.variables)

    def dataset(self, group: str) -> Any:
        """Return a group of arrays as an xarray Dataset with units and long names.

        Raises KeyError for an unknown group.
        """
        return dataset(self._group(group))

    def _group(self, name: str) -> Group:
        if name not in self.groups:
            raise KeyError(f"{self.stage} has no group {name!r}; its groups: {', '.join(self.groups) or 'none'}")
        return self.content[name]

    def to_dataframe(self, group: str = "") -> "DataFrame":
        """Return a group of arrays, by default the first, as a pandas DataFrame; `attrs["units"]` has units by column.

        Its index is made of the dimensions that all arrays share; others give columns such as `angle.1`.

        Raises KeyError for an unknown group, ConfigError if pandas is not installed.

        >>> list(simulate(strides=1).to_dataframe("steps").period_s.round(4))
        [0.7036, 0.7036]
        """
        return dataframe(self._group(group or next(iter(self.groups), "")))

    def plot(self, figure: str = "") -> "Figure":
        """Draw a figure of this result as a matplotlib Figure, by default the first one of `figures`.

        Raises ConfigError for an unknown figure.

        >>> simulate(strides=1).plot().savefig(folder / "walk.png")
        """
        figures = self._drawable()
        if figure not in ("", *figures) or not figures:
            advice = f"Choose from {', '.join(figures)}." if figures else "Plot a `dataset` instead."
            raise ConfigError(f"{self.stage}: this result has no figure {figure}".rstrip() + ".", advice)
        return figures[figure or next(iter(figures))].figure({self.stage: cast(Identified, self.content)})

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that show this result alone, as arguments of `plot`."""
        return tuple(self._drawable())

    def _drawable(self) -> "dict[str, Illustration]":
        # Imported here: it loads matplotlib.
        from walkerlab.views.figures.registry import FIGURES

        results = {self.stage: cast(Identified, self.content)}
        own = (figure for figure in FIGURES if figure.stages == (self.stage,))
        return {figure.name: figure for figure in own if figure.why_left_out(results, {}) is None}


@dataclass(frozen=True, repr=False)
class Gait(Result):
    """Result of `fixedpoint`."""

    def plot(self, figure: str = "") -> "Figure":
        """Draw the multipliers in the unit circle as a matplotlib Figure; NoAnswer if there is no gait."""
        from walkerlab.views.figures.multipliers import draw_multipliers

        if self.no_answer is not None:
            raise NoAnswer(self.no_answer)
        return super().plot(figure) if figure else draw_multipliers(self.multipliers)

    @property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the chosen gait, largest first; empty if there is no gait.

        >>> gait = find_gait()
        >>> max(abs(one) for one in gait.multipliers) == gait.summary["spectral_radius"]
        True
        """
        return tuple(complex(*pair) for pair in self.summary.get("multipliers", ()))


RESULTS: dict[str, type[Result]] = {"fixedpoint": Gait}
"""Result classes of stages whose results have additional properties."""


@dataclass(frozen=True, repr=False)
class Run:
    """Folder of stored results."""

    folder: RunFolder

    def __repr__(self) -> str:
        names = [*self.stages, *self.sweeps]
        return f"Run in {self.folder.path}: {', '.join(names) or 'no results'}"

    @property
    def config(self) -> Config:
        """Config that the results were computed with; StaleError if it cannot be determined."""
        config = config_of(self.folder)
        if config is None:
            raise StaleError(f"{self.folder.path} has no result with a readable config.")
        return config

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages with a stored result."""
        return tuple(stage.name for stage in PIPELINE.stages if self.folder.artifact(stage.name).is_file())

    @property
    def sweeps(self) -> tuple[str, ...]:
        """Names of the stored sweeps, as arguments of `sweep`."""
        return tuple(sorted(path.stem for path in self.folder.path.glob("sweep-*.h5")))

    def result(self, stage: str) -> Result:
        """Return the stored result of a stage, even if it is out of date; StaleError if it cannot be read."""
        _check_stage(stage)
        stored = result_in(self.folder, stage)
        message = stored.summary.get("no_answer")
        no_answer = None if message is None else NoAnswer(message["message"], message["advice"])
        return _result_of(stage, stored.summary, stored, no_answer, self.folder.artifact(stage))

    def sweep(self, name: str = "") -> Any:
        """Return a stored sweep as an xarray Dataset, by default the only one; StaleError if it cannot be read."""
        names = self.sweeps
        if not name and len(names) != 1:
            raise StaleError(f"{self.folder.path} has {len(names)} sweeps: {', '.join(names) or 'none'}.")
        path = self.folder.path / f"{name or names[0]}.h5"
        try:
            return dataset(artifact.read(path)[""])
        except FileNotFoundError:
            raise StaleError(f"{self.folder.path} has no sweep {name}.", f"Choose from {', '.join(names)}.") from None
        except Damaged as error:
            raise StaleError(f"{path} is damaged: {error}.", "Run the same sweep again to rebuild it.") from error


def run(
    stage: str,
    config: str | Path = DEFAULT,
    set: Mapping[str, Any] | None = None,
    runs: str | Path = RUNS,
    *,
    name: str | None = None,
    strides: int | None = None,
    force: bool = False,
    jobs: int = 1,
) -> Result:
    """Run a stage as `walkerlab STAGE` does: reuse up-to-date results, compute the others and store them.

    config   file, name of a built-in config, or name or folder of a run
    set      config keys to change, such as {"slope_deg": 3}
    runs     folder that holds all runs
    name     name of the run's folder; None derives it from the config and its changes
    strides  number of strides to walk; None keeps the config's number

    Raises ConfigError for an invalid config. If the computation has no answer, `Result.no_answer` has the reason.

    >>> gait = run("fixedpoint", set={"slope_deg": 3}, runs=folder)
    >>> round(gait.summary["period_s"], 4)
    0.7343
    >>> float(gait.dataset("corrected/gaits").period_s.max()) == gait.summary["period_s"]
    True
    """
    _check_stage(stage)
    resolved = resolve(str(config), set_options(set), strides, _folder_of(runs), name)
    warn(resolved.loaded.warnings)
    report = run_and_write(resolved, stage, Options(force=force, jobs=jobs))
    content = artifact.read(report.artifact) if report.artifact is not None else Content()
    return _result_of(stage, report.as_json(), content, report.no_answer, report.artifact)


def open_run(name: str | Path, runs: str | Path = RUNS) -> Run:
    """Open a stored run by its name in the folder `runs`, or by the path of its own folder.

    Raises ConfigError for an unknown run.

    >>> _ = run("fixedpoint", runs=folder)
    >>> open_run("paper", folder).result("fixedpoint").summary["stable"]
    True
    """
    return Run(run_named(str(name), _folder_of(runs)))


def sweep(
    stage: str,
    over: Mapping[str, Sequence[Any] | str],
    config: str | Path = DEFAULT,
    set: Mapping[str, Any] | None = None,
    runs: str | Path = RUNS,
    *,
    name: str | None = None,
    engine: str = "local",
    jobs: int = 0,
    **combined: Unpack[Combined],
) -> Any:
    """Run a sweep as `walkerlab sweep` does, and return all of its results as one xarray Dataset.

    over      values of each config key to vary, as a list or "FROM:TO:N"
    name      name of the run's folder; None derives it from the config and its changes
    jobs      number of chunks to compute in parallel; 0 lets the engine choose
    combined  zip, sample and seed, see `Combined`; by default the values form the full grid

    Raises NoAnswer if points could not be computed, or WalkerlabError if a bug is among the reasons. The other points
    are stored; `open_run` reads them.

    >>> gaits = sweep("fixedpoint", {"slope_deg": [1, 3]}, runs=folder, jobs=1)
    >>> [round(float(period), 4) for period in gaits.period_s]
    [0.7036, 0.7343]
    """
    from walkerlab.pipeline.sweeps.engines import Order, engine_named
    from walkerlab.pipeline.sweeps.question import build_sweep
    from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork, modules_of

    xarray_here()  # fail before the sweep runs if xarray is missing
    resolved = resolve(str(config), set_options(set), runs=_folder_of(runs), name=name)
    warn(resolved.loaded.warnings)
    if not isinstance(over, Mapping):
        raise ConfigError(f"over: {over!r} is not a mapping of keys to values.", 'For example {"slope_deg": [1, 2]}.')
    listed = [(key, sweep_values(key, value), f"over {key}") for key, value in over.items()]
    block = resolved.loaded.config.sweep or SweepBlock()
    options: dict[str, Any] = {key: value for key, value in combined.items() if value is not None}
    question = build_sweep(stage, listed, **{"seed": block.seed, **options})
    chosen, address = engine_named(engine)
    order = Order(jobs, address, modules_of(stage, resolved.loaded.config, PIPELINE), resolved.folder.path)
    swept = SweepRun(question, resolved.loaded, resolved.folder).run(SweepWork(chosen, order))
    if swept.failed:
        raise swept.error()
    return dataset(swept.content[""])


def walker(type: Literal["compass", "straight-legs", "kneed", "parts"], **keys: Any) -> Walker:
    """Build the config block of a walker of any type; omitted keys have their defaults.

    Raises ConfigError for a key or value that the type does not allow.
    """
    return validate_tree(tree_of({"walker": {"type": type, **keys}}, NOWHERE)).walker


def compass(
    *,
    leg_length_m: float | None = None,
    foot_to_mass_m: float | None = None,
    leg_mass_kg: float | None = None,
    hip_mass_kg: float | None = None,
    leg_inertia_kg_m2: float | None = None,
    foot_radius_m: float | None = None,
    torso: Mapping[str, Any] | None = None,
    hip: Mapping[str, Any] | None = None,
    **others: Any,
) -> CompassWalker:
    """Build a compass walker: two straight legs with a mass on each, and a mass at the hip; by default the paper's.

    Arguments are keys of the config's block `walker`, see docs/config.md; None leaves a key at its default. Raises
    ConfigError for other keys and for values that are not allowed.

    >>> compass(hip_mass_kg=20).total_mass_kg
    30.0
    """
    return cast(CompassWalker, walker("compass", **_passed(locals())))


def kneed(
    *,
    thigh: Mapping[str, Any] | None = None,
    shank: Mapping[str, Any] | None = None,
    hip_mass_kg: float | None = None,
    foot_radius_m: float | None = None,
    foot_centre_ahead_m: float | None = None,
    knee: Mapping[str, Any] | None = None,
    torso: Mapping[str, Any] | None = None,
    hip: Mapping[str, Any] | None = None,
    **others: Any,
) -> Kneed:
    """Build a walker with knees that lock; by default Hsu Chen's walker. Arguments and errors are as for `compass`.

    >>> kneed(hip_mass_kg=1.0).total_mass_kg
    2.1
    """
    return cast(Kneed, walker("kneed", **_passed(locals())))


def contact(
    *,
    units: Literal["adams", "si"] | None = None,
    stiffness: float | None = None,
    exponent: float | None = None,
    damping: float | None = None,
    full_damping_penetration: float | None = None,
    friction: str | None = None,
    static_friction: float | None = None,
    dynamic_friction: float | None = None,
    stiction_velocity: float | None = None,
    friction_velocity: float | None = None,
    terrain: Literal["checkerboard", "after-mid-swing", "plane"] | None = None,
    pad_pitch: float | Literal["rigid", "own"] | None = None,
    stance: Literal["free", "pinned"] | None = None,
    **others: Any,
) -> Contact:
    """Build the ground of the contact model; values are in N, mm, s as in ADAMS dialogs, unless `units="si"`.

    Arguments are keys of the config's block `contact`; None leaves a key at its default.

    >>> contact(static_friction=0.6, dynamic_friction=0.5).stiffness
    100000.0
    """
    block = validate_tree(tree_of({"contact": _passed(locals())}, NOWHERE)).contact
    assert block is not None, "a block set by an argument is in the config"
    return block


def _passed(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the keys that a caller passed: `others`, and all other arguments that are not None."""
    others: dict[str, Any] = arguments.pop("others")
    return {name: value for name, value in arguments.items() if value is not None} | others


def find_gait(walker: Walker | None = None, slope_deg: float | None = None, **keys: Any) -> Gait:
    """Find the periodic gaits of a walker on a slope, in memory; `summary` has the chosen gait, `dataset` all of them.

    Here and in the functions below, omitted arguments have the values of the built-in `paper` config.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    keys       other config keys, such as gravity_m_s2, equations, seed

    Raises ConfigError for values that are not allowed, as do all functions below.

    >>> gait = find_gait(compass(hip_mass_kg=10), slope_deg=3)
    >>> gait.summary["stable"], round(gait.summary["period_s"], 4)
    (True, 0.7343)
    """
    return cast(Gait, in_memory("fixedpoint", config_of_scene(walker, {"slope_deg": slope_deg}, keys)))


def simulate(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    strides: int | None = None,
    **keys: Any,
) -> Result:
    """Simulate a walk in memory; it starts on the gait unless `start` is passed.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; None simulates the rigid model
    keys       other config keys, such as start, gravity_m_s2, solver

    >>> walk = simulate(slope_deg=1, strides=2)
    >>> walk.summary["outcome"], walk.summary["steps"]
    ('walked', 4)
    >>> walk.dataset("trajectory").angle.dims
    ('time', 'leg')
    """
    values = {"slope_deg": slope_deg, "contact": contact, "strides": strides}
    config = config_of_scene(walker, values, keys)
    return in_memory("simulate" if contact is None else "contact-sim", config)


def continue_gait(
    walker: Walker | None = None,
    over: str | None = None,
    span: tuple[float, float] | None = None,
    slope_deg: float | None = None,
    **keys: Any,
) -> Result:
    """Follow families of gaits over a config parameter, in memory; `summary` has the branches and bifurcations.

    walker     built by `compass`, `kneed` or `walker`
    over       config key to vary
    span       first and last value, in the key's unit
    slope_deg  slope in deg, positive downhill, if `over` is another key
    keys       other keys of the block `continuation`, such as model, or of the config, such as contact, seed
    """
    ends = {} if span is None else dict(zip(("from", "to"), _two_numbers("span", _plain(span)), strict=True))
    values = {"slope_deg": slope_deg, **_stage_block("continuation", keys, over=over, **ends)}
    return in_memory("continuation", config_of_scene(walker, values, keys))


def basin(
    walker: Walker | None = None, slope_deg: float | None = None, cells: tuple[int, int] | None = None, **keys: Any
) -> Result:
    """Find which starts lead to which attractor, in memory; `summary` has their fractions, `dataset` a grid of starts.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    cells      number of cells of the grid along each axis
    keys       other keys of the block `basin`, such as model, or of the config, such as seed
    """
    values = {"slope_deg": slope_deg, **_stage_block("basin", keys, cells=cells)}
    return in_memory("basin", config_of_scene(walker, values, keys))


def robustness(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    to: Sequence[str] = (),
    walks: int | None = None,
    **keys: Any,
) -> Result:
    """Find the largest disturbances that a gait survives and the parameter that matters most, in memory.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    to         parameters with respect to which the gait is differentiated; by default all that the model reads
    walks      number of walks on each rough ground
    keys       other keys of the block `robustness`, such as model, steps, roughness_m, or of the config
    """
    values = {"slope_deg": slope_deg, **_stage_block("robustness", keys, to=to or None, walks=walks)}
    return in_memory("robustness", config_of_scene(walker, values, keys))


def explore(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    runs: str | Path = RUNS,
    **keys: Any,
) -> Any:
    """Return the page of `walkerlab explore` for a notebook; its `url` opens in a browser, and `close()` stops it.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; None shows only the rigid model
    runs       folder that holds all runs, for reports and films made from the page
    keys       other config keys
    """
    from walkerlab.views.explore.server import Server
    from walkerlab.views.explore.walks import ExploredConfig, sets_of

    config = config_of_scene(walker, {"slope_deg": slope_deg, "contact": contact}, keys)
    server = Server(0, ExploredConfig(None, sets_of(config), _folder_of(runs), {}, called="your walker"))
    server.begin()
    return server


def design(walker: Walker | None = None, over: Mapping[str, Any] | None = None, **keys: Any) -> Result:
    """Find, in memory, the walker with the smallest or largest gait quantity; `summary["best"]` has the optimal values.

    walker  built by `compass`, `kneed` or `walker`
    over    bounds (low, high) of the parameters to vary, in the key's unit
    keys    minimise or maximise, keep (bounds of other gait quantities), model, starts; other config keys
    """
    return in_memory("design", config_of_scene(walker, _stage_block("design", keys, over=over or {}), keys))


def read_walk(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    walker: Walker | None = None,
    slope_deg: float | None = None,
    walks: str | None = None,
    **keys: Any,
) -> Result:
    """Read a walk from a file, in memory; `summary` has its steps, `dataset` its steps and samples.

    path       CSV, table or results (.res) of ADAMS, OpenSim (.mot, .sto), markers (.trc, .c3d), or a stored walk (.h5)
    columns    column of each quantity that the header does not identify, such as {"angle 1": "hip_r"}
    units      units by kind, quantity or column, if the file does not state them, such as {"angle": "deg"}
    walker     walker that made the recording, built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    walks      direction of a walk of markers, as the recording sees it: left, right, away or towards
    keys       other config keys

    Raises ConfigError for a file without a walk.
    """
    recording = {"file": str(path), "columns": dict(columns or {}), "units": dict(units or {}), "walks": walks}
    values = {"slope_deg": slope_deg, "recording": recording}
    return in_memory("recorded-walk", config_of_scene(walker, values, keys))


def identify(
    walk: str | Path | Mapping[str, Sequence[float]],
    config: str | Path | Config = DEFAULT,
    fit: Sequence[str] | Mapping[str, Sequence[float] | None] = (),
    prior: Mapping[str, Sequence[float]] | None = None,
    **keys: Any,
) -> Result:
    """Estimate, in memory, a walker's parameters from a measured walk; `summary["estimates"]` has one row for each.

    walk    file, or columns by name: period_s and optionally length_m of each step, or time, angle 1 and angle 2
    config  known properties of the walker: a Config, a config file or built-in name, or a run
    fit     keys to estimate, or a mapping of each key to its bounds, in the key's unit
    prior   known value and standard deviation, by key
    keys    other keys of the block `identify`, such as level, model, nuisance

    Raises ConfigError for invalid arguments or files. If the fit does not converge, `Result.no_answer` has the reason.
    """
    if isinstance(walk, Mapping):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "walk.csv"
            path.write_bytes(csv_text(list(walk), zip(*walk.values(), strict=True)))
            return identify(path, config, fit, prior, **keys)
    bounds = dict(fit) if isinstance(fit, Mapping) else dict.fromkeys(fit)
    block = {**keys, "data": str(walk), "fit": bounds, "prior": dict(prior or {})}
    return in_memory("identify", with_blocks(config, identify=block))


def plan_measurements(
    config: str | Path | Config = DEFAULT,
    fit: Sequence[str] = (),
    prior: Mapping[str, Sequence[float]] | None = None,
    model: str = "rigid",
    **keys: Any,
) -> Result:
    """Find, in memory, which measurements would determine a walker's parameters; see `summary["measurements"]`.

    config  known properties of the walker: a Config, a config file or built-in name, or a run
    fit     keys to estimate
    prior   known value and standard deviation, by key
    model   rigid or contact
    keys    keys of the block `plan`, such as steps, max_steps, errors, period_noise_s

    Raises ConfigError for invalid arguments. If the walk ends too early, `Result.no_answer` has the reason.
    """
    question = {"fit": dict.fromkeys(fit), "prior": dict(prior or {}), "model": model}
    return in_memory("plan", with_blocks(config, identify=question, plan=keys))


def with_blocks(config: str | Path | Config, **blocks: Mapping[str, Any]) -> Config:
    """Return a config with some blocks replaced; `config` may also be a file, a built-in name or a run."""
    start = config if isinstance(config, Config) else resolve(str(config)).loaded.config
    tree = {**start.model_dump(mode="json", exclude_none=True, by_alias=True), **blocks}
    return validate_tree(tree_of(tree, NOWHERE))


def export_model(
    path: str | Path,
    walker: Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    law: str = "contact",
    slope: str = "gravity",
    **keys: Any,
) -> tuple[Path, ...]:
    """Write a walker, started on its gait, as a model for ADAMS (.adm, .cmd) or MuJoCo (.xml); return all its files.

    path       file of the model; commands (.acf) for an .adm model, or the script of a driven or kneed walker, are
               written next to it
    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; by default the paper's, on pads
    law        contact force in ADAMS: `contact` for ADAMS's, `functions` for exactly walkerlab's
    slope      what is tilted in MuJoCo: `gravity`, or `geometry` for the ground and the walker on it
    keys       other config keys, such as start, strides, push_off

    Raises ConfigError for an unknown format or a walker that the format cannot express, NoAnswer if no gait is found.
    """
    from walkerlab.exchange import export
    from walkerlab.pipeline.store.files import write_through

    path = Path(path)
    kind = export.ENDINGS.get(path.suffix.removeprefix("."))
    if kind is None:
        raise ConfigError(
            f"{path}: not a model.", f"Choose a file name that ends in one of .{', .'.join(export.ENDINGS)}."
        )
    ground = contact or Contact(terrain="checkerboard")
    config = config_of_scene(walker, {"slope_deg": slope_deg, "contact": ground}, keys)
    texts = _export_texts(config, kind, law, slope, path.stem)
    for name, text in texts.items():
        write_through(path.with_name(name), text.encode())
    return tuple(path.with_name(name) for name in texts)


def mujoco_model(config: str | Path | Config | Run = DEFAULT, slope: str = "gravity", **blocks: Any) -> tuple[Any, Any]:
    """Return a walker as a MuJoCo model and its data at the start of the gait; plain `mujoco.mj_step` makes it walk.

    Drives and knees are a control callback, which MuJoCo calls in each step. Callbacks are global: this model walks
    until the next call, and `mujoco.set_mjcb_control(None)` must come before another model is compiled.

    config  a Config, a config file or built-in name, or a run
    slope   what is tilted: `gravity`, or `geometry` for the ground and the walker on it
    blocks  other keys of the config, such as walker, contact, push_off

    Raises ConfigError if MuJoCo is not installed or cannot express the walker, NoAnswer if no gait is found.

    >>> model, data = mujoco_model("kneed")
    >>> import mujoco
    >>> mujoco.mj_step(model, data, 10_000)
    >>> print(f"{data.time:.2f} s, {data.qpos[0]:.2f} m")
    0.10 s, -0.15 m
    >>> mujoco.set_mjcb_control(None)
    """
    try:
        import mujoco
    except ImportError as error:
        raise ConfigError("a MuJoCo model needs MuJoCo, which is not installed.", "pip install mujoco") from error
    from walkerlab.exchange.mujoco_script import Walk

    start = config.config if isinstance(config, Run) else config
    scene = with_blocks(start, **{name: _plain(value) for name, value in blocks.items()})
    text = next(iter(_export_texts(scene, "mjcf", "contact", slope, None).values()))
    mujoco.set_mjcb_control(None)
    walk = Walk(mujoco.MjModel.from_xml_string(text))
    return walk.model, walk.data


def _export_texts(config: Config, kind: Any, law: str, slope: str, stem: str | None) -> dict[str, str]:
    """Return the files of a model, by name, after finding its gait."""
    from walkerlab.exchange import export
    from walkerlab.pipeline.stages.walk import rigid_start
    from walkerlab.pipeline.store.provenance import git_commit

    inputs = {}
    if config.start == "fixed-point":
        gait = in_memory("fixedpoint", config)
        if gait.no_answer is not None:
            raise NoAnswer(gait.no_answer)
        inputs["fixedpoint"] = gait.content
    adams_law, tilted = export.law_named(law), export.slope_named(slope)
    start = rigid_start(config, inputs)
    return export.export_model(config, *start, kind, adams_law, git_commit(), stem, tilted).files


def _stage_block(stage: str, keys: dict[str, Any], **values: Any) -> dict[str, Any]:
    block = block_of(Config.model_fields[stage])
    assert block is not None, "a stage with a question has a block"
    own = {name: keys.pop(name) for name in block.model_fields if name in keys}
    entries = {name: value for name, value in {**own, **values}.items() if value is not None}
    return {stage: entries or None}


def dataset(group: Group) -> Any:
    """Convert a group of labelled arrays to an xarray Dataset; variables named after a dimension become coordinates."""
    data = {
        name: (variable.dims, variable.values, {"units": variable.units, "long_name": variable.long_name})
        for name, variable in group.variables.items()
    }
    result = xarray_here().Dataset(data, attrs=dict(group.attrs))
    return result.set_coords(str(group.attrs.get("coordinates", "")).split())


def dataframe(group: Group) -> "DataFrame":
    """Convert a group of labelled arrays to a pandas DataFrame; ConfigError if pandas is not installed."""
    try:
        import pandas
    except ImportError as error:
        raise ConfigError("a DataFrame needs pandas, which is not installed.", "pip install pandas") from error
    sizes = {
        dim: size for one in group.variables.values() for dim, size in zip(one.dims, one.values.shape, strict=True)
    }
    labels = {dim: group.variables[dim].values if dim in group.variables else range(sizes[dim]) for dim in sizes}
    arrays = {name: variable for name, variable in group.variables.items() if name not in sizes}
    shared = [dim for dim in sizes if all(dim in variable.dims for variable in arrays.values())]
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, variable in arrays.items():
        others = [dim for dim in variable.dims if dim not in shared]
        order = [variable.dims.index(dim) for dim in (*others, *shared)]
        parts = variable.values.transpose(order).reshape(-1, math.prod(sizes[dim] for dim in shared))
        for part, place in zip(parts, itertools.product(*(labels[dim] for dim in others)), strict=True):
            column = ".".join([name, *map(str, place)])
            columns[column], units[column] = part, variable.units
    index = pandas.MultiIndex.from_product([labels[dim] for dim in shared], names=shared)
    frame = pandas.DataFrame(columns, index.get_level_values(0) if len(shared) == 1 else index)
    frame.attrs["units"] = units
    return frame


def xarray_here() -> Any:
    """Import xarray; ConfigError if it is not installed."""
    try:
        import xarray
    except ImportError as error:
        raise ConfigError("a Dataset needs xarray, which is not installed.", "pip install xarray") from error
    return xarray


def in_memory(stage: str, config: Config) -> Result:
    """Compute a stage and its inputs without files; ConfigError if the config lacks a block that the stage needs."""
    _check_stage(stage)
    PIPELINE[stage].refuse_question(config)
    memory = MemoryResults()
    answer = answer_in_memory(config, stage, memory)
    identity = memory.keys.identity(PIPELINE[stage], config, {})
    content = Identified(answer.groups, answer.summary, answer.timed, complete=answer.complete, identity=identity)
    return _result_of(stage, answer.findings, content, answer.no_answer)


def config_of_scene(walker: Any, values: Mapping[str, Any], keys: Mapping[str, Any]) -> Config:
    """Build the paper config with another scene; it has a contact block only if one is passed.

    walker  walker block; None keeps the paper's
    values  values and blocks by key; None keeps the paper's value
    keys    further keys

    Raises ConfigError for unknown keys and invalid values.
    """
    scene = {key: value for key, value in {"walker": walker, **values}.items() if value is not None}
    for name in scene.keys() & MADE_HERE.keys():
        kinds, makers = MADE_HERE[name]
        if not isinstance(scene[name], kinds):
            raise ConfigError(f"{name}: {scene[name]!r} is not a {name} block.", makers)
    lines = {key: _plain(value) for key, value in {"name": "memory", **keys, **scene}.items()}
    replaced = {"source", "contact", *({"walker"} & lines.keys())}
    upper = tree_of(lines, NOWHERE)
    tree = merge_layers([*(layer.without(*replaced) for layer in read_layers(builtin_config(DEFAULT))), upper])
    config, moved = align_start(validate_tree(tree), tree)
    warn([*suspicious_values(config, tree), *moved], inside=1)
    return config


def warn(messages: Iterable[str], inside: int = 0) -> None:
    """Issue warnings that point at the line that called the API; `inside` counts the functions in between."""
    for text in messages:
        warnings.warn(text, stacklevel=3 + inside)


def _plain(value: Any) -> Any:
    if isinstance(value, Block):
        return value.model_dump(mode="json")
    return value.tolist() if hasattr(value, "tolist") else value


def _two_numbers(name: str, values: Any) -> Sequence[Any]:
    if not isinstance(values, Sequence) or len(values) != 2:
        raise ConfigError(f"{name}: {values!r} is not a pair of numbers.", f"For example {name}=(0.001, 0.09).")
    return values


def set_options(values: Mapping[str, Any] | None) -> list[str]:
    """Convert values of keys to `--set` options; ConfigError if they are not a mapping."""
    if not isinstance(values, Mapping | NoneType):
        raise ConfigError(f"set: {values!r} is not a mapping of keys to values.", 'For example set={"slope_deg": 3}.')
    return [f"{key}={json.dumps(value)}" for key, value in (values or {}).items()]


def _folder_of(runs: Any) -> Path:
    if not isinstance(runs, str | os.PathLike):
        raise ConfigError(f"runs: {runs!r} is not a folder.", 'For example runs="runs".')
    return Path(runs)


def sweep_values(key: str, values: Any) -> str | list[Any]:
    """Return the values of a sweep's parameter, or the text of a range; ConfigError for anything else."""
    # Imported late: few callers sweep.
    from walkerlab.pipeline.sweeps.question import MAX_POINTS

    if isinstance(values, str) and not values.lstrip().startswith("["):
        return values
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise ConfigError(
            f"over {key}: {values!r} is not a list of values, nor a range FROM:TO:N.",
            f'For example {{"{key}": [1, 2]}} or {{"{key}": "1:3:5"}}.',
        )
    return list(itertools.islice(values, MAX_POINTS + 1))  # one value too many is enough for the error


def _check_stage(stage: str) -> None:
    names = [known_stage.name for known_stage in PIPELINE.stages]
    if stage not in names:
        raise ConfigError(f"{stage}: unknown stage.", f"Choose from {', '.join(names)}.")


def _result_of(
    stage: str, summary: Mapping[str, Any], content: Content, no_answer: NoAnswer | None, path: Path | None = None
) -> Result:
    message = None if no_answer is None else no_answer.message
    return RESULTS.get(stage, Result)(stage, summary, content, message, path)
