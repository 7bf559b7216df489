"""Stages of a pipeline, and the options of their commands.

Extensions declare their stages with this module, and the command line builds its help from these. To keep the
help fast, it imports no stage, no config schema and no NumPy.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from walkerlab.config import reads
from walkerlab.config.reads import SceneConfig, StartConfig
from walkerlab.errors import ConfigError
from walkerlab.extensions import load

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

Inputs = Callable[["Config"], tuple[str, ...]]
WALKED = ("fixedpoint", "simulate", "contact-sim")
DRAWINGS = ("plot", "report")
Lacks = Callable[["Config"], tuple[dict[str, str], ...]]
OptionKind = Literal[
    "word", "int", "float", "switch", "text", "texts", "key", "bounds", "bounds-or-none", "pairs", "numbers", "units"
]
"""Ways to read an option's value, as listed in docs/adding.md."""


def message_without_block(name: str) -> str:
    """Return the message that the config lacks the block `name`."""
    return f"the config has no {name} block"


def nothing(_config: object) -> tuple[Any, ...]:
    """Return an empty tuple, for stages without inputs or omitted parts."""
    return ()


def dependency(name: str, code: str) -> "Callable[[Config], Mapping[str, Any]]":
    """Return a function of the config that returns {name: value}, where `code`, "module:name", computes the value."""
    return lambda config: {name: load(code)(config)}


def results_of(*names: str) -> Inputs:
    """Return a function of the config that returns these stage names for every config."""
    return lambda _config: names


def gait_unless_start_is_given(config: StartConfig) -> tuple[str, ...]:
    """Require the fixed point unless the config gives a start state, which also works on slopes without a gait."""
    return ("fixedpoint",) if config.start == "fixed-point" else ()


def gait_for_start_or_pads(config: SceneConfig) -> tuple[str, ...]:
    """Require the fixed point if the start state or the pitch of pads comes from it."""
    ground = config.contact
    pitch_of_gait = ground is not None and ground.terrain == "checkerboard" and ground.pad_pitch == "rigid"
    return ("fixedpoint",) if pitch_of_gait else gait_unless_start_is_given(config)


def walks_and(*names: str) -> Inputs:
    """Return a function that lists the stages of `WALKED`, `recorded-walk` if a config has a recording, and `names`."""
    return lambda config: (*WALKED, *(() if config.recording is None else ("recorded-walk",)), *names)


@dataclass(frozen=True)
class Option:
    """Command-line option of a stage. It sets a config key or selects another stage."""

    flag: str  # as typed, such as --steps
    key: str  # dotted config key
    metavar: str  # placeholder in the help
    help: str
    kind: OptionKind = "word"
    needs: tuple[str, ...] = ()  # flags that must be given with it
    runs: str = ""  # stage that the option selects instead; such an option sets no config key


STRIDES = Option("--strides", "strides", "N", "Strides to walk; one stride is two steps.", "int")


def recording_options(block: str, *needs: str) -> tuple[Option, ...]:
    """Return options for what a recording does not state. They set keys of `block` and can be used only together with
    the flags `needs`."""
    options = (
        Option("--columns", "columns", "QUANTITY=COLUMN,...", "Columns: NAME, -NAME, NAME+90deg, HIP>FOOT.", "pairs"),
        Option("--units", "units", "KIND=UNIT,...", "Units of columns, where the file does not state them.", "units"),
        Option("--walks", "walks", "left|right|away|towards", "Direction of the walk in the picture."),
        Option(
            "--camera-tilt", "camera_tilt_deg", "DEG|floor|free", "Tilt of the line from which angles are measured."
        ),
        Option("--belt-speed", "belt_speed_m_s", "M/S", "Speed of a treadmill's belt.", "float"),
        Option("--fps", "fps", "N", "Frames per second of the film.", "float"),
        Option("--from-s", "from_s", "S", "Read the recording from this time on.", "float"),
        Option("--to-s", "to_s", "S", "Read the recording up to this time.", "float"),
        Option(
            "--min-likelihood", "min_likelihood", "P", "Likelihood below which a marker counts as missing.", "float"
        ),
    )
    return tuple(replace(option, key=f"{block}.{option.key}", needs=needs) for option in options)


@dataclass(frozen=True)
class Stage:
    """One stage of the pipeline."""

    name: str  # name shared by the stage, its command and its artifact
    module: str  # module of its `run` function; imported only when the stage runs
    purpose: str  # one line for the user
    # Type of the slice of the config that `run` takes and on which the result depends, or a function that returns this
    # type for a config. None means the whole config.
    takes: "type | Callable[[Config], type] | None"
    inputs: Inputs = nothing  # returns the earlier stages whose results this stage needs under a config
    needs_equal_legs: bool = False
    if_current: tuple[str, ...] = ()  # stages whose results this stage uses only if they are current
    options: tuple[Option, ...] = ()  # options of the stage's command in addition to those of all stages
    requires: tuple[str, ...] = ()  # config blocks that the stage needs; it is left out if one is missing
    # "times": it measures run times, so it must run alone. "draws": it also writes files, from the results that exist.
    work: Literal["computes", "times", "draws"] = "computes"
    # The only command that runs the stage: its own or `STAGE --full`. Empty if it also runs for stages that need it.
    only_by: str = ""
    finds: str = ""  # name of the config that the command writes with the parameters found; empty if it writes none
    early_with: tuple[str, ...] = ()  # stages whose results suffice for a partial drawing while others still run
    does_without: Lacks = nothing  # returns the parts that the stage omits under a config: name, reason and saving
    # returns, by name, whatever else the result depends on, such as files (digests) and other programs (versions)
    depends_on: "Callable[[Config], Mapping[str, Any]]" = lambda _config: {}
    checks: "Callable[[Config], object]" = nothing  # raises ConfigError for a config with which no command should run
    # "module:name" of the `Offer` of the stage's command. Empty for the usual command, which works on a run.
    adds_command: str = ""
    needed_by: tuple[str, ...] = ()  # stages of `DRAWINGS` that need this one's result
    shown_by: tuple[str, ...] = ()  # stages of `DRAWINGS` that show this one's result if it is current

    def takes_under(self, config: "Config") -> type | None:
        """Return the type of the config slice on which the stage's result depends, or None for the whole config."""
        return self.takes if self.takes is None or isinstance(self.takes, type) else self.takes(config)

    def reads(self, config: "Config") -> tuple[str, ...]:
        """Return the dotted config keys on which the stage's result depends."""
        takes = self.takes_under(config)
        return tuple(type(config).model_fields if takes is None else reads.dotted_keys(takes))

    def results(self, config: "Config") -> tuple[str, ...]:
        """Return the stages whose results this stage uses: required ones, then optional ones."""
        return (*self.inputs(config), *self.if_current)

    def why_unsuited(self, config: "Config") -> str | None:
        """Return the reason why the stage cannot run under a config, or None if it can."""
        missing = (block for block in self.requires if getattr(config, block) is None)
        return next(map(message_without_block, missing), None) or self.why_no_such_legs(config)

    def why_no_such_legs(self, config: "Config") -> str | None:
        """Return the reason why the stage does not support a config's unequal legs, or None if it does."""
        if not self.needs_equal_legs:
            return None
        # Imported here to keep the help of the command line fast. Equal legs need no mechanics.
        from walkerlab.config.second_leg import states_second_leg

        if not states_second_leg(config):
            return None
        from walkerlab.scene.rigid import have_different_legs

        return "the legs differ" if have_different_legs(config) else None

    def refuse_unsuited(self, target: str, config: "Config") -> None:
        """Raise ConfigError if this stage, which `target` needs, cannot run under a config."""
        if "recording" in self.requires and config.recording is None:
            advice = "Name its file: walkerlab compare --with FILE."
            raise ConfigError(f"{target} needs a recorded walk, and {message_without_block('recording')}.", advice)
        if self.why_no_such_legs(config) is not None:
            advice = f"Leave out what differs in the second leg, or run another stage, such as {', '.join(WALKED)}."
            raise ConfigError(f"{target} needs two equal legs, but those of this walker differ.", advice)
        # Imported here to keep the help of the command line fast.
        from walkerlab.config.walkers import contact_required_error, contact_to_add

        if "check" in self.requires and config.check is None:
            advice = "`walkerlab init FILE --check` writes one to fill in."
            raise ConfigError(f"{target} needs a printed gait, and {message_without_block('check')}.", advice)
        if self.why_unsuited(config) is not None:
            block = f"`{contact_to_add(config.walker)}`"
            instead = f"Add one to the config, such as the paper's, scaled by this walker's mass: {block}."
            advice = f"{instead} `walkerlab schema contact` explains its keys."
            raise contact_required_error(target, config.walker, advice)

    def refuse_question(self, config: "Config") -> None:
        """Raise ConfigError if the stage is on demand and the `refuse` function of its module rejects the config."""
        refuse = getattr(importlib.import_module(self.module), "refuse", None) if self.on_demand else None
        if refuse is not None:
            refuse(reads.restrict(config, self.takes_under(config)))

    @property
    def draws(self) -> bool:
        """Whether the stage writes files in addition to its artifact."""
        return self.work == "draws"

    @property
    def command(self) -> str:
        return self.only_by or self.name

    @property
    def on_demand(self) -> bool:
        """Whether only the command of the same name runs the stage."""
        return self.only_by == self.name
