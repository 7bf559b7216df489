"""Walker to export, standing on its ground at the start of a walk, and walkerlab's simulation of that walk."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import walkerlab
from walkerlab.config import drives, walkers
from walkerlab.errors import ConfigError
from walkerlab.exchange import engine_scene, planar
from walkerlab.physics.ground.terrain import STANCE_FOOT, foothold_height
from walkerlab.physics.hybrid.contact_result import ContactWalkResult
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene import contact, rigid

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

PADS_BEHIND = 2
PADS_AHEAD = 4
RESERVED = ("ground", "world", "walker")
MIN_WEIGHT = 1e-12  # weights of a coupling below this count as zero


@dataclass(frozen=True)
class Pad:
    """Ground for one foot: a floor for the entire walk, or one pad of the foot's lane."""

    foot: int
    centre_m: float
    length_m: float
    height_m: float


class GaitStart(NamedTuple):
    """State at the start of a walk, and the step lengths of the gait.

    step_length_m  mean step length (m), the default distance between pads
    state          the gait, or another state with both feet on the slope
    asymmetry      difference between the gait's step lengths over their mean, for the lanes of pads
    """

    step_length_m: float
    state: State
    asymmetry: float = 0.0


@dataclass(frozen=True)
class Exported:
    """Walker on its ground at the start of a walk, with walkerlab's simulation of that walk."""

    config: "Config"
    scene: engine_scene.EngineScene  # walker and ground in the form that other programs need
    steps: int  # maximum number of steps of the walk
    walk: ContactWalkResult  # walk of the contact model from that start
    heights: Floats | None  # (footholds,) heights of uneven ground (m); None on even ground
    pinned: bool  # whether a revolute joint holds the stance foot until the first touchdown

    @property
    def model(self) -> planar.PlanarModel:
        return self.scene.model

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Unique names of the links, valid in other programs. Link 0 is the first stance leg, hinged at the hip."""
        names: list[str] = []
        for link in self.model.links:
            name = identifier(link.name)
            # There are more candidate names than links, so at least one is not in use.
            choices = (name, *(f"{name}_{number}" for number in range(2, len(self.model.links) + 3)))
            names.append(next(choice for choice in choices if choice not in (*names, *RESERVED)))
        return tuple(names)

    @cached_property
    def start(self) -> tuple[Floats, Floats]:
        """Coordinates (m, rad) and velocities (m/s, rad/s) of the model at the start."""
        return self.scene.from_base(self.scene.start)

    @property
    def impulses_N_s(self) -> tuple[float, float]:
        """Impulse of the push-off of each leg."""
        return drives.push_offs(self.config.push_off)

    @property
    def hip(self) -> drives.Hip:
        return self.config.walker.hip

    @property
    def hip_link(self) -> int:
        """Index of the link that is hinged to the base at the hip. It belongs to the leg that swings first."""
        upper = self.scene.assembly.legs[1 - STANCE_FOOT][0]
        return [link.name for link in self.model.links].index(upper)

    @property
    def knee_links(self) -> tuple[int, ...]:
        """Indices of the shank links, by leg: two, one (of the first leg) or none."""
        # The first two coordinates are the position of the base.
        return tuple(index - 2 for index in self.scene.knee_indices)

    @cached_property
    def couplings(self) -> list[dict[int, float]]:
        """Weights of hinge angles, by link, for each body that follows others. The weighted sum of its hinge angles is
        zero.
        """
        weights = []
        for row in planar.coupling_rows(self.scene.assembly, self.model):
            # Relative angles suffice only if the weights add up to 1, because then the angle of the base drops out.
            if abs(row[0]) > MIN_WEIGHT:
                raise ConfigError(
                    "A body whose coupling weights do not add up to 1 cannot be exported.",
                    "Choose weights that add up to 1 in walker.couplings.",
                )
            weights.append({int(link): float(row[link]) for link in np.flatnonzero(np.abs(row) > MIN_WEIGHT)})
        return weights

    @cached_property
    def pads(self) -> tuple[Pad, ...]:
        """Ground under the feet: one floor for each foot, or pads from behind the start to beyond the end of
        the walk.
        """
        terrain = self.scene.ground.terrain
        pitch = terrain.pitch
        last = self.steps + PADS_AHEAD
        if not terrain.has_pads:
            span = (PADS_BEHIND + last) * pitch
            return tuple(Pad(foot, 0.5 * span - PADS_BEHIND * pitch, span, 0.0) for foot in range(2))
        pads = []
        uneven = terrain._replace(heights=self.heights)
        for number in range(-PADS_BEHIND, last + 1):
            height = 0.0 if self.heights is None else float(foothold_height(uneven, number))
            foot = STANCE_FOOT if number % 2 == 0 else 1 - STANCE_FOOT
            pads.append(Pad(foot, number * pitch + self.lane_shift_m(foot), pitch, height))
        return tuple(pads)

    def lane_shift_m(self, foot: int) -> float:
        """Distance (m) along the slope by which a foot's pads are shifted because the steps of the two legs differ."""
        terrain = self.scene.ground.terrain
        return terrain.lanes[foot] - round(terrain.lanes[foot] / terrain.pitch) * terrain.pitch

    def lane_across_m(self, foot: int) -> float:
        """Signed distance (m) of a foot's lane from the plane of the walk. No ball reaches the other lane."""
        distance = self.half_lane_m + 0.01 * self.config.walker.leg_length_m
        return -distance if foot == STANCE_FOOT else distance

    @property
    def half_lane_m(self) -> float:
        """Half the width of a lane (m)."""
        return max(ball.radius_m for ball in self.model.balls) + 0.02 * self.config.walker.leg_length_m

    @property
    def touches_s(self) -> list[float]:
        """Times (s) of the touchdowns in walkerlab's walk, one at the end of each step."""
        return [float(time) for time in self.walk.touch_time_s]

    @property
    def model_name(self) -> str:
        return identifier(self.config.name)

    def describe(self, left_out: Iterable[str], commit: str | None, tilted: str) -> Iterator[str]:
        """Yield the header of an exported file: origin, slope, walkerlab's walk for comparison, and omissions.

        tilted  what the file tilts to express the slope
        """
        yield f"Written by walkerlab {walkerlab.__version__}" + (f", commit {commit}" if commit else "") + "."
        yield f"Config: {self.config.name}. Slope: {self.scene.ours.slope:.10g} rad, as tilted {tilted}."
        yield f"walkerlab's contact model from this start: {self.walk.outcome.label}, {self.walk.steps} steps."
        if self.walk.steps:
            yield f"Its last step: {self.walk.periods_s[-1]:.7g} s, {self.walk.lengths_m[-1]:.7g} m."
            touches = [f"{time:.7g}" for time in self.touches_s]
            yield from (f"Touches (s): {', '.join(touches[k : k + 8])}" for k in range(0, len(touches), 8))
        yield from (f"Left out: {text}" for text in left_out)


def identifier(name: str) -> str:
    """Reduce a name to letters, digits and underscores, beginning with a letter."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    return plain if plain[:1].isalpha() else f"m_{plain}"


def prepare_export(config: "Config", start: GaitStart) -> Exported:
    """Place the walker of a config on its ground, with the start that `contact-sim` derives from a rigid start.

    Raises ConfigError for a walker or a ground that cannot be exported.
    """
    refuse(config)
    contact_scene = contact.scene_on_pads(config, start.step_length_m, start.state, asymmetry=start.asymmetry)
    steps = 2 * config.strides
    scene = engine_scene.scene_for_engines(contact_scene, start.state)
    heights = rigid.foothold_heights(config.ground, steps + 1)
    walk = contact_scene.walk(scene.start, steps, contact.tolerances_of(config, steps), None, heights)
    return Exported(config, scene, steps, walk, heights, contact_scene.pinned)


def refuse(config: "Config") -> None:
    """Raise ConfigError for a ground or a walker that no format can express."""
    if config.contact is None:
        raise walkers.contact_required_error("Export", config.walker, "Add a contact block, as in the config paper.")
    if config.contact.terrain == "after-mid-swing":
        raise ConfigError(
            "Ground that carries a foot only after mid-swing cannot be exported: other programs have no such ground.",
            "Set contact.terrain=checkerboard.",
        )
    if config.walker.hip.hinge_law != drives.LINEAR:
        raise ConfigError(
            f"The hinge law {config.walker.hip.hinge_law} cannot be exported.", "Set walker.hip.hinge_law=linear."
        )
    if config.contact.terrain == "plane" and not config.ground.even:
        raise ConfigError(
            "Uneven ground can be exported only as pads of different heights.",
            "Set contact.terrain=checkerboard, or leave out the block ground.",
        )


def finite(value: float) -> str:
    """Format a number with all its digits, without a trailing `.0`."""
    return "0" if float(value) == 0.0 else repr(float(value)).removesuffix(".0")
