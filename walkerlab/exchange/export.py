"""Export a walker with the start of its gait to ADAMS and MuJoCo."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeVar, get_args

from walkerlab.config.walkers import Kneed
from walkerlab.errors import ConfigError
from walkerlab.exchange import adams, exported, mjcf, planar
from walkerlab.exchange.adams_model import adams_model
from walkerlab.exchange.mjcf import Slope

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

Kind = Literal["adm", "cmd", "mjcf"]
Law = Literal["contact", "functions"]
Choice = TypeVar("Choice", bound=str)
CONTACT_LAWS: Final[tuple[Law, ...]] = get_args(Law)
SLOPES: Final[tuple[Slope, ...]] = get_args(Slope)
ENDINGS: Final[dict[str, Kind]] = {"adm": "adm", "cmd": "cmd", "xml": "mjcf", "mjcf": "mjcf"}
"""Format by file extension."""


@dataclass(frozen=True)
class ExportedFiles:
    """Exported texts by file name (the model comes first), and descriptions of what the export leaves out."""

    files: dict[str, str]
    left_out: tuple[str, ...]


def export_model(
    config: "Config",
    start: exported.GaitStart,
    kind: Kind,
    law: Law = "contact",
    commit: str | None = None,
    stem: str | None = None,
    slope: Slope = "gravity",
) -> ExportedFiles:
    """Export a walker to another program, with the start that `contact-sim` derives from a rigid start.

    kind    adm: dataset and commands of ADAMS/Solver; cmd: commands of Adams View; mjcf: MuJoCo model
    law     contact law in ADAMS: the built-in contact between shapes, or walkerlab's law as functions
    commit  commit of walkerlab, for the header of the file
    stem    stem of the file names; by default the config's name
    slope   in MuJoCo: whether gravity is tilted, or the ground and the walker on it

    Raises ConfigError if the format cannot express something that affects the walk, NoAnswer if the distance between
    pads depends on a contact gait and none is found.
    """
    # With MuJoCo, the exported script simulates the plastic impact, so no stop is needed.
    locked = config if kind == "mjcf" else add_stops(config)
    export = exported.prepare_export(locked, start)
    stem = stem or export.model_name
    left_out = tuple(parts_left_out(export, config, kind, law, f"{stem}.py"))
    head = list(export.describe(left_out, commit, "gravity" if slope == "gravity" else "ground"))
    if kind == "mjcf":
        script = {f"{stem}.py": mjcf.script_text()} if mjcf.parts_of_script(export) else {}
        return ExportedFiles({f"{stem}.xml": mjcf.walker_text(export, head, slope)} | script, left_out)
    if slope == "geometry":
        raise ConfigError(
            "--slope geometry is for MuJoCo: models for ADAMS have tilted gravity.", "Leave it out for ADAMS."
        )
    model = adams_model(export, law)
    pinned_until_s = export.touches_s[0] if export.pinned and export.touches_s else None
    if kind == "cmd":
        text = adams.view_text(model, head, export.walk.end_time_s, pinned_until_s)
        return ExportedFiles({f"{stem}.cmd": text}, left_out)
    dataset = f"{stem}.adm"
    commands = adams.command_text(model, dataset, export.walk.end_time_s, pinned_until_s)
    return ExportedFiles({dataset: adams.dataset_text(model, head), f"{stem}.acf": commands}, left_out)


def choose(text: str, choices: tuple[Choice, ...], option: str, what: str) -> Choice:
    """Return the choice named by `text`, the value of an option.

    Raises ConfigError for an unknown name.
    """
    for choice in choices:
        if text == choice:
            return choice
    raise ConfigError(f"{option} {text}: unknown {what}.", f"Choose from {', '.join(choices)}.")


def parse_law(text: str) -> Law:
    """Return the ADAMS contact law with the name `text`. Raises the same error as `choose` if there is no such law."""
    return choose(text, CONTACT_LAWS, "--law", "contact law")


def parse_slope(text: str) -> Slope:
    """Return the slope format named `text`. Raises the same error as `choose` if there is none."""
    return choose(text, SLOPES, "--slope", "way to express a slope")


def add_stops(config: "Config") -> "Config":
    """Return a config in which a stop brings each knee to rest before it locks.

    When a joint is activated, ADAMS changes velocities by other rules than ours. If the knee is at rest, they have no
    effect.
    """
    walker = config.walker
    if not isinstance(walker, Kneed) or walker.knee.lock == "compliant":
        return config
    stopped = walker.model_copy(update={"knee": walker.knee.model_copy(update={"lock": "compliant"})})
    return config.model_copy(update={"walker": stopped})


def parts_left_out(export: exported.Exported, config: "Config", kind: Kind, law: Law, script: str) -> Iterator[str]:
    """Describe what an exported model leaves out of a config's walk, or replaces."""
    by_functions = kind != "mjcf" and law == "functions"
    if export.scene.ground.terrain.has_pads:
        yield "the end of a walk when a foot hits a pad from the side; here the pad pushes the foot away"
    if not by_functions and any(radius == 0.0 for radius in export.scene.ours.whole.radius):
        yield f"point feet, replaced by balls of {1e3 * planar.SMALLEST_BALL_M:g} mm on ground lower by the same amount"
    if kind == "mjcf":
        if parts := mjcf.parts_of_script(export):
            yield f"{', '.join(parts)}, which the script {script} applies instead"
    else:
        # The configs differ only if `add_stops` has replaced an ideal lock.
        if export.config is not config:
            yield "the plastic impact that locks a knee; a stop catches it first, as with walker.knee.lock: compliant"
        when = "act at the touch times of walkerlab's walk, because ADAMS functions have no memory"
        if any(export.impulses_N_s):
            yield f"the trigger of push-offs; open-loop pulses {when}"
        if export.hip.torque_N_m:
            yield f"the trigger that switches the hip torque between legs; switches {when}"
    yield "detection of falls, slides and steps, and the energy balance"
