"""Walkers as models for other programs, at the start of their gait."""

from pathlib import Path
from typing import TYPE_CHECKING, cast

from walkerlab.api import memory
from walkerlab.api.results import Gait, Result, Setting, optional_module
from walkerlab.api.runs import Run
from walkerlab.config import files, loader, schema, tree, validation, walkers
from walkerlab.config.contact import Contact
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.pipeline.plan import graph, results
from walkerlab.pipeline.store.artifact import Identified, Identity
from walkerlab.pipeline.store.files import write_through
from walkerlab.pipeline.store.runs import RunFolder

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

    from walkerlab.exchange.export import Kind


def export_model(
    path: str | Path,
    walker: walkers.Walker | None = None,
    slope_deg: float | None = None,
    contact: Contact | None = None,
    law: str = "contact",
    slope: str = "gravity",
    **keys: Setting,
) -> tuple[Path, ...]:
    """Write a walker, started on its gait, as a model for ADAMS (.adm, .cmd) or MuJoCo (.xml).

    path       file of the model. Commands (.acf) for an .adm model, or the script of a driven or kneed walker, are
               written next to it
    walker     built by `compass`, `kneed` or `walker`
    slope_deg  slope in deg, positive downhill
    contact    ground of the contact model, built by `contact`; by default the paper's, on pads
    law        contact force in ADAMS: `contact` for ADAMS's, `functions` for exactly walkerlab's
    slope      what is tilted in MuJoCo: `gravity`, or `geometry` for the ground and the walker on it
    keys       other config keys, such as start, strides, push_off

    Returns the paths of all files. Raises ConfigError for an unknown format or a walker that the format cannot express,
    NoAnswer if no gait is found.

    >>> [path.name for path in export_model(folder / "compass.adm", slope_deg=1)]
    ['compass.adm', 'compass.acf']
    """
    from walkerlab.exchange import export

    path = Path(path)
    if (kind := export.ENDINGS.get(path.suffix.removeprefix("."))) is None:
        endings = ", .".join(export.ENDINGS)
        raise ConfigError(f"{path}: not a model.", f"Choose a file name that ends in one of .{endings}.")
    ground = contact or Contact(terrain="checkerboard")
    config = memory.config_of_scene(walker, {"slope_deg": slope_deg, "contact": ground}, keys)
    texts = export_texts(config, kind, law, slope, path.stem)
    for name, text in texts.items():
        write_through(path.with_name(name), text.encode())
    return tuple(path.with_name(name) for name in texts)


def mujoco_model(
    config: str | Path | schema.Config | Run | Gait = files.DEFAULT, slope: str = "gravity", **blocks: Setting
) -> "tuple[MjModel, MjData]":
    """Build a walker as a MuJoCo model with data at the start of its gait. Plain `mujoco.mj_step` makes it walk.

    A control callback, which MuJoCo calls in each step, simulates drives and knees. Callbacks are global: this model
    walks until the next call, and `mujoco.set_mjcb_control(None)` must come before another model is compiled.

    config  a Config, a config file or built-in name, a run, or a gait. A gait that was found in memory has no ground,
            so the paper's is used, on pads
    slope   what is tilted: `gravity`, or `geometry` for the ground and the walker on it
    blocks  other keys of the config, such as walker, contact, push_off

    Returns the model and its data. Raises ConfigError if MuJoCo is not installed or cannot express the walker, NoAnswer
    if no gait is found.

    >>> model, data = mujoco_model("kneed")
    >>> import mujoco
    >>> mujoco.mj_step(model, data, 10_000)
    >>> print(f"{data.time:.2f} s, {data.qpos[0]:.2f} m")
    0.10 s, -0.15 m
    >>> mujoco.set_mjcb_control(None)
    """
    mujoco = optional_module("mujoco", "a MuJoCo model", "MuJoCo")
    from walkerlab.exchange.mujoco_script import Walk

    gait = None
    if isinstance(config, Gait):
        gait, config = config, config_of_gait(config)
    start = config.config if isinstance(config, Run) else config
    scene = memory.add_blocks(start, **{name: memory.plain(value) for name, value in blocks.items()})
    # If the changed keys change the gait, it has to be found again.
    if isinstance(start, schema.Config) and identity_of_gait(start) != identity_of_gait(scene):
        gait = None
    text = next(iter(export_texts(scene, "mjcf", "contact", slope, None, gait).values()))
    mujoco.set_mjcb_control(None)
    walk = Walk(mujoco.MjModel.from_xml_string(text))
    return walk.model, walk.data


def config_of_gait(gait: Gait) -> schema.Config:
    """Return the config of the gait's run. For a gait found in memory, use its walker on the paper's ground."""
    if gait.artifact is not None:
        return Run(RunFolder.open_folder(gait.artifact.parent)).config
    identity = cast(Identified, gait.content).identity
    read = {name: value for name, value in identity.config_slice.items() if name in schema.Config.model_fields}
    lines = {"name": "memory", "contact": {"terrain": "checkerboard"}, **read}
    return validation.validate_tree(loader.tree_of(lines, tree.NOWHERE))


def identity_of_gait(config: schema.Config) -> Identity:
    return results.MemoryResults().keys.identity(graph.PIPELINE["fixedpoint"], config, {})


def export_texts(
    config: schema.Config, kind: "Kind", law: str, slope: str, stem: str | None, gait: Result | None = None
) -> dict[str, str]:
    """Return the text of each file of a model by file name. If `gait` is None, find the gait first."""
    from walkerlab.exchange import export
    from walkerlab.exchange.exported import GaitStart
    from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
    from walkerlab.pipeline.store.provenance import git_commit

    inputs = {}
    if config.start == "fixed-point":
        gait = gait or memory.run_in_memory("fixedpoint", config)
        if gait.no_answer is not None:
            raise NoAnswer(gait.no_answer)
        inputs["fixedpoint"] = gait.content
    tilted = export.parse_slope(slope)
    start = GaitStart(*rigid_start(config, inputs), step_asymmetry(config, inputs))
    return export.export_model(config, start, kind, export.parse_law(law), git_commit(), stem, tilted).files
