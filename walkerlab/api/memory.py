"""Build walkers and grounds in Python, and compute stages in memory, without files."""

import inspect
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, TypeVar, Unpack, cast, get_args

import numpy as np

from walkerlab.api.results import Gait, Result, Setting, result_of
from walkerlab.api.runs import RUNS, check_stage, folder_of, warn
from walkerlab.config import fields, loader, schema, validation
from walkerlab.config.contact import Contact
from walkerlab.config.files import DEFAULT, builtin_config, merge_layers, read_layers
from walkerlab.config.recording import Recorded
from walkerlab.config.tree import NOWHERE
from walkerlab.config.walkers import CompassWalker, Kneed, Walker
from walkerlab.errors import ConfigError
from walkerlab.pipeline.plan import graph, resolve, results
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.store.artifact import Identified
from walkerlab.pipeline.store.files import csv_text

if TYPE_CHECKING:
    from walkerlab.views.explore.server import Server

__all__ = [
    "basin", "check", "compass", "contact", "continue_gait", "design", "explore", "find_gait", "identify", "kneed",
    "plan_measurements", "read_walk", "robustness", "simulate", "walker",
]  # fmt: skip
MADE_HERE: dict[str, tuple[tuple[type[fields.Block], ...], str]] = {
    "walker": (
        tuple(fields.kinds_of(schema.Config.model_fields["walker"]).values()),
        "walkerlab.compass(), kneed() and walker(type) make one.",
    ),
    "contact": ((Contact,), "walkerlab.contact() makes one."),
}
"""Types of the arguments that are config blocks, and advice on how to build such a block."""

F = TypeVar("F", bound=Callable[..., object])


class CompassKeys(TypedDict, total=False):
    """Keys of a compass walker. `walkerlab schema walker` has their defaults and bounds."""

    leg_length_m: float
    foot_to_mass_m: float
    leg_mass_kg: float
    hip_mass_kg: float
    leg_inertia_kg_m2: float
    foot_radius_m: float
    torso: Mapping[str, Setting]
    hip: Mapping[str, Setting]
    leg_2: Mapping[str, Setting]  # keys of the second leg that differ from the first's


class KneedKeys(TypedDict, total=False):
    """Keys of a walker with knees. `walkerlab schema walker` has their defaults and bounds."""

    thigh: Mapping[str, Setting]
    shank: Mapping[str, Setting]
    hip_mass_kg: float
    foot_radius_m: float
    foot_centre_ahead_m: float
    knee: Mapping[str, Setting]
    torso: Mapping[str, Setting]
    hip: Mapping[str, Setting]
    leg_2: Mapping[str, Setting]  # keys of the second leg that differ from the first's


class ContactKeys(TypedDict, total=False):
    """Keys of the contact model's ground. `walkerlab schema contact` has their defaults and bounds."""

    units: Literal["adams", "si"]
    normal_force: str
    stiffness: float
    exponent: float
    damping: float
    full_damping_penetration: float
    friction: str
    static_friction: float
    dynamic_friction: float
    stiction_velocity: float
    friction_velocity: float
    terrain: Literal["checkerboard", "after-mid-swing", "plane"]
    pad_pitch: float | Literal["rigid", "own"]
    stance: Literal["free", "pinned"]


def show_keys(function: F) -> F:
    """Show the keys in the TypedDict of a function's `**keys` as parameters, so that notebooks complete them."""
    (keys,) = get_args(inspect.get_annotations(function)["keys"])
    named = [inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=None) for key in keys.__annotations__]
    vars(function)["__signature__"] = inspect.signature(function).replace(parameters=named)
    return function


def stated_keys(keys: Mapping[str, object]) -> dict[str, Setting]:
    """Return the keys that a caller passed, without those that are None, which keep the default."""
    return {name: cast(Setting, value) for name, value in keys.items() if value is not None}


def walker(type: str, **keys: Setting) -> Walker:
    """Build the config block of a walker.

    type  type of the walker
    keys  keys of the config's block `walker`, in the units at the end of their names; omitted keys have their defaults

    Returns the block, an argument of the functions below. Raises ConfigError for a key or value that the type does not
    allow.

    >>> walker("straight-legs", foot_radius_m=0.3).leg_length_m
    0.4
    """
    return validation.validate_tree(loader.tree_of({"walker": {"type": type, **keys}}, NOWHERE)).walker


@show_keys
def compass(**keys: Unpack[CompassKeys]) -> CompassWalker:
    """Build a compass walker: two straight legs with a mass on each, and a mass at the hip. The default is the walker
    of the paper.

    keys  keys of the config's block `walker`, in m, kg and kg m^2; see docs/config.md

    Returns the block, an argument of the functions below. Raises ConfigError for other keys and for values that are not
    allowed.

    >>> compass(hip_mass_kg=20).total_mass_kg
    30.0
    """
    return cast(CompassWalker, walker("compass", **stated_keys(keys)))


@show_keys
def kneed(**keys: Unpack[KneedKeys]) -> Kneed:
    """Build a walker with knees that lock. The default is Hsu Chen's walker.

    keys  keys of the config's block `walker`, in m, kg and kg m^2; see docs/config.md

    Returns the block, an argument of the functions below. Raises ConfigError for other keys and for values that are not
    allowed.

    >>> kneed(hip_mass_kg=1.0).total_mass_kg
    2.1
    """
    return cast(Kneed, walker("kneed", **stated_keys(keys)))


@show_keys
def contact(**keys: Unpack[ContactKeys]) -> Contact:
    """Build the ground of the contact model.

    keys  keys of the config's block `contact`, in N, mm, s as in ADAMS dialogs, unless `units="si"`; see docs/config.md

    Returns the block, an argument of `simulate` and `explore`. Raises ConfigError for other keys and for values that
    are not allowed.

    >>> contact(static_friction=0.6, dynamic_friction=0.5).stiffness
    100000.0
    """
    block = validation.validate_tree(loader.tree_of({"contact": stated_keys(keys)}, NOWHERE)).contact
    assert block is not None, "a block set by an argument is in the config"
    return block


def find_gait(walker: Walker | None = None, slope_deg: float | None = None, **keys: Setting) -> Gait:
    """Find the periodic gaits of a walker on a slope, in memory.

    Here and in the functions below, omitted arguments have the values of the built-in `paper` config.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    keys       other config keys, such as gravity_m_s2, equations, seed

    Returns a result whose `summary` has the chosen gait and whose arrays have a row for each gait. If there is no gait,
    `no_answer` says why. Raises ConfigError for values that are not allowed.

    >>> gait = find_gait(compass(hip_mass_kg=10), slope_deg=3)
    >>> gait.stable, round(gait.period_s, 4)
    (True, 0.7343)
    """
    return cast(Gait, run_in_memory("fixedpoint", config_of_scene(walker, {"slope_deg": slope_deg}, keys)))


def simulate(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    strides: int | None = None,
    **keys: Setting,
) -> Result:
    """Simulate a walk in memory. It starts on the gait unless `start` is passed.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; None simulates the rigid model
    strides    number of strides to walk, two steps each
    keys       other config keys, such as start, gravity_m_s2, solver

    Returns a result with the outcome, one row for each step, and one for each sample of the trajectory. Raises
    ConfigError for values that are not allowed.

    >>> walk = simulate(slope_deg=1, strides=2)
    >>> walk.outcome, walk.steps
    ('walked', 4)
    >>> walk.dataset("trajectory").angle.dims
    ('time', 'leg')
    """
    config = config_of_scene(walker, {"slope_deg": slope_deg, "contact": contact, "strides": strides}, keys)
    return run_in_memory("simulate" if contact is None else "contact-sim", config)


def continue_gait(
    walker: Walker | None = None,
    over: str | None = None,
    span: tuple[float, float] | None = None,
    slope_deg: float | None = None,
    **keys: Setting,
) -> Result:
    """Follow families of gaits as a config parameter varies, in memory.

    walker     built by `compass`, `kneed` or `walker`
    over       config key to vary
    span       first and last value, in the key's unit
    slope_deg  slope in deg, positive downhill, if `over` is another key
    keys       other keys of the block `continuation`, such as model, or of the config, such as contact, seed

    Returns a result whose `summary` has the branches and bifurcations, and whose arrays have a row for each point of a
    branch. Raises ConfigError for values that are not allowed.

    >>> families = continue_gait(over="slope_deg", span=(3, 5), periods=1)
    >>> [row["kind"] for row in families.bifurcations]
    ['flip']
    """
    ends = {} if span is None else dict(zip(("from", "to"), two_numbers("span", plain(span)), strict=True))
    values = {"slope_deg": slope_deg, **stage_block("continuation", keys, over=over, **ends)}
    return run_in_memory("continuation", config_of_scene(walker, values, keys))


def basin(
    walker: Walker | None = None, slope_deg: float | None = None, cells: tuple[int, int] | None = None, **keys: Setting
) -> Result:
    """Find which starts lead to which attractor, in memory.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    cells      number of cells of the grid of starts, along each of its two axes
    keys       other keys of the block `basin`, such as model, or of the config, such as seed

    Returns a result whose `summary` has the share of starts that lead to walking, and whose arrays have the outcome of
    each cell. Raises ConfigError for values that are not allowed.

    >>> basin(cells=(6, 4)).dataset("basin").outcome.shape
    (6, 4)
    """
    values = {"slope_deg": slope_deg, **stage_block("basin", keys, cells=cells)}
    return run_in_memory("basin", config_of_scene(walker, values, keys))


def robustness(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    to: Sequence[str] = (),
    walks: int | None = None,
    **keys: Setting,
) -> Result:
    """Find the largest disturbances that a gait survives and the parameter that matters most, in memory.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    to         parameters with respect to which the gait is differentiated; by default all that the model reads
    walks      number of walks on each rough ground
    keys       other keys of the block `robustness`, such as model, steps, roughness_m, or of the config

    Returns a result whose `summary` has the largest steps up and down (m), the largest pushes (N s) and the
    sensitivities. Raises ConfigError for values that are not allowed.

    >>> limits = robustness(slope_deg=3, to=["slope_deg"], model="rigid", roughness_m=[])
    >>> limits.largest_step[0]["down_m"] > 0.001
    True
    """
    values = {"slope_deg": slope_deg, **stage_block("robustness", keys, to=to or None, walks=walks)}
    return run_in_memory("robustness", config_of_scene(walker, values, keys))


def design(walker: Walker | None = None, over: Mapping[str, Setting] | None = None, **keys: Setting) -> Result:
    """Find, in memory, the walker with the smallest or largest gait quantity.

    walker  built by `compass`, `kneed` or `walker`
    over    bounds (low, high) of the parameters to vary, in the key's unit
    keys    minimise or maximise, keep (bounds of other gait quantities), model or starts, or other config keys

    Returns a result whose `summary` has the best values by key, and the quantity before and after. Raises ConfigError
    for values that are not allowed.

    >>> best = design(over={"slope_deg": (2, 3)}, maximise="speed_m_s", starts=1, slope_deg=2.5)
    >>> best.best
    {'slope_deg': 3.0}
    """
    return run_in_memory("design", config_of_scene(walker, stage_block("design", keys, over=over or {}), keys))


def read_walk(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    walker: Walker | None = None,
    slope_deg: float | None = None,
    **keys: Setting,
) -> Result:
    """Read a walk from a file, in memory.

    path       CSV, table or results (.res) of ADAMS, OpenSim (.mot, .sto), markers (.trc, .c3d), or a stored walk (.h5)
    columns    column of each quantity that the header does not identify, such as {"angle 1": "hip_r"}
    units      units by kind, quantity or column, if the file does not state them, such as {"angle": "deg"}
    walker     walker that made the recording, built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    keys       other keys of the block `recording`, such as walks, camera_tilt_deg or fps, or of the config

    Returns a result whose `summary` has the steps, and whose arrays have a row for each step and each sample. Raises
    ConfigError for a file without a walk.

    >>> stored = run("simulate", runs=folder, strides=2)
    >>> read_walk(stored.artifact).steps
    4
    """
    stated = {name: keys.pop(name) for name in Recorded.model_fields.keys() & keys.keys()}
    recording = {"file": str(path), "columns": dict(columns or {}), "units": dict(units or {}), **stated}
    values = {"slope_deg": slope_deg, "recording": recording}
    return run_in_memory("recorded-walk", config_of_scene(walker, values, keys))


def identify(
    walk: str | Path | Mapping[str, Sequence[float]],
    config: str | Path | schema.Config = DEFAULT,
    fit: Sequence[str] | Mapping[str, Sequence[float] | None] = (),
    prior: Mapping[str, Sequence[float]] | None = None,
    **keys: Setting,
) -> Result:
    """Estimate, in memory, a walker's parameters from a measured walk.

    walk    file, or columns by name: period_s and optionally length_m of each step (steps,), or time, angle 1 and
            angle 2 (samples,)
    config  known properties of the walker: a Config, a config file or built-in name, or a run
    fit     keys to estimate, or a mapping of each key to its bounds, in the key's unit
    prior   known value and standard deviation, by key
    keys    other keys of the block `identify`, such as level, model, nuisance

    Returns a result whose `summary["estimates"]` has one row for each parameter. If the fit does not converge,
    `no_answer` has the reason. Raises ConfigError for invalid arguments or files.

    >>> walk = simulate(slope_deg=3, strides=4, start=[None, 0.225, -0.37, -1.1])
    >>> found = identify({"period_s": walk.step_periods_s}, "slope-3deg", ["slope_deg"], level="steps")
    >>> round(found.estimates[0]["value"], 2)
    3.0
    """
    if isinstance(walk, Mapping):
        if len({len(values) for values in walk.values()}) > 1:
            sizes = ", ".join(f"{name} {len(values)}" for name, values in walk.items())
            raise ConfigError(f"walk: the columns differ in length: {sizes}.", "Give columns of equal length.")
        # Write the columns to a file, so that they go through the same checks as a file and give the same messages.
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "walk.csv"
            path.write_bytes(csv_text(list(walk), zip(*walk.values(), strict=True)))
            return identify(path, config, fit, prior, **keys)
    bounds = dict(fit) if isinstance(fit, Mapping) else dict.fromkeys(fit)
    block: dict[str, Setting] = {**keys, "data": str(walk), "fit": bounds, "prior": dict(prior or {})}
    return run_in_memory("identify", add_blocks(config, identify=block))


def check(
    config: str | Path | schema.Config = DEFAULT,
    printed: Mapping[str, str | float | Sequence[str | float]] | None = None,
    **keys: Setting,
) -> Result:
    """Check a printed gait in memory.

    config   the walker: a Config, a config file or built-in name, or a run
    printed  values by name, such as {"period_s": "0.60"}; None keeps those of the config's block `check`. Give strings,
             because the number of digits matters
    keys     other keys of the block `check`, such as angles, instant, state_before

    Returns a result whose `summary["values"]` has a verdict for each value, and whose `explanations` say why values
    differ. Raises ConfigError for invalid arguments, and for a config without printed values.

    >>> check("simplest", {"state": ["0.20031", "-0.19983"]}, angles={"from": "slope-normal"}).finding
    'reproduced'
    """
    start = config if isinstance(config, schema.Config) else resolve.resolve(str(config)).loaded.config
    stated = {} if start.check is None else start.check.model_dump(mode="json", exclude_none=True, by_alias=True)
    block = {**stated, **keys, **({} if printed is None else {"printed": dict(printed)})}
    return run_in_memory("check", add_blocks(start, **({"check": block} if block else {})))


def plan_measurements(
    config: str | Path | schema.Config = DEFAULT,
    fit: Sequence[str] = (),
    prior: Mapping[str, Sequence[float]] | None = None,
    model: str = "rigid",
    **keys: Setting,
) -> Result:
    """Find, in memory, which measurements would determine a walker's parameters.

    config  known properties of the walker: a Config, a config file or built-in name, or a run
    fit     keys to estimate
    prior   known value and standard deviation, by key
    model   rigid or contact
    keys    keys of the block `plan`, such as steps, max_steps, errors, period_noise_s

    Returns a result whose `summary["measurements"]` has the expected standard errors of each way to measure. If the
    walk ends too early, `no_answer` has the reason. Raises ConfigError for invalid arguments.

    >>> plan = plan_measurements("slope-3deg", ["slope_deg"], steps=4, max_steps=4)
    >>> plan.measurements[3]["measurement"]
    'angles over time'
    """
    question: dict[str, Setting] = {"fit": dict.fromkeys(fit), "prior": dict(prior or {}), "model": model}
    return run_in_memory("plan", add_blocks(config, identify=question, plan=keys))


def explore(
    walker: Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    runs: str | Path = RUNS,
    **keys: Setting,
) -> "Server":
    """Serve the page of `walkerlab explore`, for a notebook.

    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; None shows only the rigid model
    runs       folder that holds all runs, for reports and films made from the page
    keys       other config keys

    Returns the server: its `url` opens in a browser, and `close()` stops it. Raises ConfigError for values that are not
    allowed.

    >>> page = explore(slope_deg=1)
    >>> page.url[:17]
    'http://127.0.0.1:'
    >>> page.close()
    """
    from walkerlab.views.explore.server import Server
    from walkerlab.views.explore.walks import ExploredConfig, set_arguments

    config = config_of_scene(walker, {"slope_deg": slope_deg, "contact": contact}, keys)
    server = Server(0, ExploredConfig(None, set_arguments(config), folder_of(runs), {}, called="your walker"))
    server.begin()
    return server


def run_in_memory(stage: str, config: schema.Config) -> Result:
    """Compute a stage and its inputs without files.

    Raises ConfigError if the config lacks a block that the stage needs.
    """
    check_stage(stage)
    graph.PIPELINE[stage].refuse_question(config)
    memory = results.MemoryResults()
    answer = answer_in_memory(config, stage, memory)
    identity = memory.keys.identity(graph.PIPELINE[stage], config, {})
    content = Identified(answer.groups, answer.summary, answer.timed, complete=answer.complete, identity=identity)
    return result_of(stage, answer.findings, content, answer.no_answer)


def config_of_scene(walker: Walker | None, values: Mapping[str, Setting], keys: Mapping[str, Setting]) -> schema.Config:
    """Build the paper config with another scene. It has a contact block only if one is passed.

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
    lines = {key: plain(value) for key, value in {"name": "memory", **keys, **scene}.items()}
    # A scene with other values does not come from the paper, so drop its `source`. Keys of the paper's walker would be
    # merged into those of another type.
    replaced = {"source", "contact", *({"walker"} & lines.keys())}
    upper = loader.tree_of(lines, NOWHERE)
    tree = merge_layers([*(layer.copy_without(*replaced) for layer in read_layers(builtin_config(DEFAULT))), upper])
    config, moved = validation.align_start(validation.validate_tree(tree), tree)
    warn([*loader.suspicious_values(config, tree), *moved], inside=1)
    return config


def add_blocks(config: str | Path | schema.Config, **blocks: Setting) -> schema.Config:
    """Return a config with some blocks replaced. `config` may also be a file, a built-in name or a run."""
    start = config if isinstance(config, schema.Config) else resolve.resolve(str(config)).loaded.config
    tree = {**start.model_dump(mode="json", exclude_none=True, by_alias=True), **blocks}
    return validation.validate_tree(loader.tree_of(tree, NOWHERE))


def stage_block(stage: str, keys: dict[str, Setting], **values: Setting) -> dict[str, Setting]:
    """Remove a stage's keys from `keys`. Return {stage: those keys together with `values`}."""
    block = fields.block_of(schema.Config.model_fields[stage])
    assert block is not None, "a stage with a question has a block"
    block_keys = {name: keys.pop(name) for name in block.model_fields if name in keys}
    entries = {name: value for name, value in {**block_keys, **values}.items() if value is not None}
    return {stage: entries or None}


def plain(value: Setting) -> Setting:
    if isinstance(value, fields.Block):
        return value.model_dump(mode="json")
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def two_numbers(name: str, values: Setting) -> Sequence[Setting]:
    if not isinstance(values, Sequence) or len(values) != 2:
        raise ConfigError(f"{name}: {values!r} is not a pair of numbers.", f"For example {name}=(0.001, 0.09).")
    return values
