"""The contact model's step map over a parameter, on the section of `contact_section`, for families of gaits."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.terrain import Terrain, after_mid_swing, checkerboard
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import JudgedGround
from walkerlab.hybrid.outcome import Outcome
from walkerlab.orbits.contact_section import Floats, SectionStep, angled_bodies, step_from_section, turning_bodies
from walkerlab.orbits.step_maps import (
    REMEMBERED,
    Iterates,
    MappedStep,
    Monitor,
    difference_formula,
    no_step,
    walk_steps,
)
from walkerlab.solvers.registry import Tolerances


@dataclass(frozen=True)
class WalkerOnGround:
    """A walker at one value of the parameter, and the ground it walks on."""

    walker: ContactWalker
    ground: JudgedGround


class ContactMap:
    """A walker on compliant ground, its coordinates where the feet pass, in units of leg length and pendulum time.

    Pads let the swing foot of straight legs through, so that a family is followed where it touches only ahead of the
    stance foot; `watch` says where pads of the gait's own step length would trip it. The derivative along the section
    is exact, that along the parameter a difference of exact steps, which only steers.
    """

    monitors = (
        Monitor("slip_m", "m", "largest net slip of a foot from touch to lift"),
        Monitor("tripped", "1", "whether pads of its own step length trip the swing foot", 0.5),
    )

    def __init__(
        self,
        walker_at: Callable[[float], WalkerOnGround | None],
        scale: float,
        tolerances: Tolerances,
        step_length_m: float,
        on_pads: bool,
        like: ContactWalker,
    ) -> None:
        """A family of walkers.

        walker_at      walker and ground at a value of the parameter; None where it makes no walker
        scale          magnitude of changes of the parameter that matter
        tolerances     how to integrate a step
        step_length_m  that steps are judged by
        on_pads        whether the ground that was asked for has pads, so that tripping is to be watched
        like           one of the walkers
        """
        self._at = lru_cache(REMEMBERED)(walker_at)
        self._near = lru_cache(REMEMBERED)(self._formula)
        self._scale, self.tolerances, self._measure, self._on_pads = scale, tolerances, step_length_m, on_pads
        self._units: Floats | None = None
        angled, turning = angled_bodies(like, STANCE_FOOT), turning_bodies(like, STANCE_FOOT)
        self._angles, self._rates = len(angled), len(turning)
        rates = (f"rate_{body}" for body in turning)
        self.names = ("height", *(f"angle_{body}" for body in angled), "along_rate", "height_rate", *rates)

    def _formula(self, p: float) -> tuple[list[WalkerOnGround], Floats] | None:
        return difference_formula(self._at, p, min(self._scale, abs(p)) if p != 0.0 else self._scale)

    def units(self, frame_length: float, pendulum_time: float) -> Floats:
        """(d,) what one unit of each coordinate is in SI; those of the first walker, whatever the parameter."""
        if self._units is None:
            L, tau = frame_length, pendulum_time
            self._units = np.array([L, *[1.0] * self._angles, L / tau, L / tau, *[1.0 / tau] * self._rates])
        return self._units

    def of_section(self, z: Floats, p: float) -> Floats:
        """Coordinates of a point of the section in SI."""
        here = self._at(p)
        assert here is not None, "a point of the section belongs to a walker"
        return np.asarray(z / self.units(here.ground.frame.leg_length, here.ground.frame.pendulum_time))

    def _walk(self, here: WalkerOnGround, z: Floats, terrain: Terrain) -> SectionStep:
        units = self.units(here.ground.frame.leg_length, here.ground.frame.pendulum_time)
        measure = terrain.stride_measure if terrain.has_pads else self._measure
        return step_from_section(
            here.walker, JudgedGround(terrain, here.ground.frame), self.tolerances, z * units, measure
        )

    def _terrain(self, here: WalkerOnGround) -> Terrain:
        terrain = here.ground.terrain
        return after_mid_swing(self._measure) if terrain.has_pads else terrain

    def step(self, z: Floats, p: float) -> MappedStep:
        """One step with all derivatives."""
        here, near = self._at(p), self._near(p)
        if here is None or near is None:
            return no_step(Outcome.REJECTED, z.size)
        step = self._walk(here, z, self._terrain(here))
        if step.outcome is not Outcome.WALKED:
            return no_step(step.outcome, z.size)
        Dp = np.zeros(z.size)
        for beside, weight in zip(*near, strict=True):
            other = self._walk(beside, z, self._terrain(beside))
            if other.outcome is not Outcome.WALKED:
                return no_step(other.outcome, z.size)
            Dp += weight * other.z
        return self._mapped(here, step, Dp)

    def _mapped(self, here: WalkerOnGround, step: SectionStep, Dp: Floats) -> MappedStep:
        frame = here.ground.frame
        units = self.units(frame.leg_length, frame.pendulum_time)
        half = min(1.0, max(-1.0, 0.5 * step.spacing_m / frame.leg_length))
        return MappedStep(
            Outcome.WALKED,
            step.z / units,
            step.DP * units / units[:, None],
            Dp / units,
            step.period_s,
            step.length_m,
            math.asin(half) - here.walker.slope,
            step.touch_s,
        )

    def watch(self, z: Floats, p: float, steps: int) -> Floats:
        """Largest slip, and whether pads would trip a gait of one step."""
        here = self._at(p)
        assert here is not None, "what is watched was walked"
        slip, tripped, at = 0.0, 0.0, z
        for _ in range(steps):
            step = self._walk(here, at, self._terrain(here))
            slip, at = max(slip, abs(step.slip_m)), step.z / self.units(1.0, 1.0)
            if self._on_pads and steps == 1:
                on_pads = self._walk(here, z, checkerboard(step.length_m, (0.0, 0.0)))
                tripped = float(on_pads.outcome is not Outcome.WALKED)
        return np.array([slip, tripped])

    def timed(self, z: Floats, p: float, steps: int, tolerances: Tolerances) -> tuple[Floats, Floats] | None:
        """Durations (steps,) in s and lengths (steps,) in m of a gait's steps, integrated otherwise."""
        other = copy(self)
        other.tolerances = tolerances
        cycle = walk_steps(other, z, p, steps)
        if cycle.outcome is not Outcome.WALKED:
            return None
        strikes = np.array([step.strike_s for step in cycle.steps])
        waits = np.array([step.period_s for step in cycle.steps]) - strikes
        return np.roll(waits, 1) + strikes, np.array([step.length_m for step in cycle.steps])

    def iterate(self, z: Floats, p: float, steps: int, tangent: Floats | None) -> Iterates:
        """A walk from section to section, step by step."""
        here = self._at(p)
        points: list[Floats] = []
        lengths: list[float] = []
        periods: list[float] = []
        angles: list[float] = []
        outcome = Outcome.REJECTED if here is None else Outcome.WALKED
        direction = None if tangent is None else np.array(tangent)
        before = 0.0
        while here is not None and len(points) < steps:
            step = self._walk(here, z, self._terrain(here))
            outcome = step.outcome
            if outcome is not Outcome.WALKED:
                break
            mapped = self._mapped(here, step, np.zeros(z.size))
            if direction is not None:
                direction = mapped.DP @ direction
                lengths.append(float(np.linalg.norm(direction)))
                direction /= lengths[-1]
            z = mapped.z
            points.append(z)
            periods.append(before + mapped.strike_s)
            angles.append(mapped.angle)
            before = mapped.period_s - mapped.strike_s
        return Iterates(
            outcome,
            np.array(points).reshape(-1, z.size),
            np.array(lengths),
            np.array(periods),
            np.array(angles),
        )
