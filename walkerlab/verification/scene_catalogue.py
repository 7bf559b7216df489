"""The catalogue of a scene's own extremes: its walker on harder and softer ground, other slopes, from other starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

from walkerlab.config.contact import Contact
from walkerlab.config.fields import Block
from walkerlab.config.schema import Config
from walkerlab.config.stability import FATES, Case, Fate
from walkerlab.config.walkers import Kneed, PartsWalker

STEPS, AS_IT_IS_STEPS = 4, 6
BUDGET = 1_000_000  # right-hand sides
FAR_TOO_FEW = 500
ENDS: tuple[Fate, ...] = tuple(
    fate for fate in FATES if fate not in ("budget-exhausted", "solver-failed", "rejected")
)  # fmt: skip
"""The ends that physics may have: where nobody knows which, a case passes by its measures alone."""
STOPS: tuple[Fate, ...] = tuple(fate for fate in ENDS if fate != "walked")
SOFTER, STICKIER = 100.0, 10.0
STOP = 10.0

Judged = tuple[Case, Config]
B = TypeVar("B", bound=Block)


def scene_cases(config: Config) -> list[Judged]:
    """The cases of a scene, each with its config.

    config  with the start spelled out in numbers, and the pads' pitch if there are pads
    """
    cases = [*rigid_cases(config)]
    if config.contact is not None:
        cases += [*ground_cases(config, config.contact), *knee_cases(config), *start_cases(config)]
    return cases


def rigid_cases(config: Config) -> Iterator[Judged]:
    """The rigid model: as it is with its twin, on another slope, at rest."""
    yield case("rigid", "the scene's rigid walk", "walkers", model="rigid", steps=10, twin=True), config
    steep = on_slope(config, 2.0 * config.slope_rad)
    yield case("rigid-twice-as-steep", "from the same start relative to the slope", "slopes", model="rigid"), steep
    still = case("rigid-standing-still", "legs apart and at rest fall back", "starts", STOPS, model="rigid")
    yield still, at_rates(config, 0.0)


def ground_cases(config: Config, ground: Contact) -> Iterator[Judged]:
    """The contact model: as it is with its twin, on other ground, at other tolerances."""
    yield case("as-it-is", "the scene's walk on its own ground", "walkers", steps=AS_IT_IS_STEPS, twin=True), config

    def on(**changes: float) -> Config:
        return changed(config, "contact", changes)

    stiffer = case("stiffness-times-100", "nearer to rigid; no more damped, so feet may bounce", "ground")
    yield stiffer, on(stiffness=SOFTER * ground.stiffness)
    yield case("stiffness-over-100", "feet sink deeper", "ground"), on(stiffness=ground.stiffness / SOFTER)
    yield case("damping-over-100", "feet bounce", "ground", agreement=1e-3), on(damping=ground.damping / SOFTER)
    creep = {name: getattr(ground, name) / STICKIER for name in ("stiction_velocity", "friction_velocity")}
    yield case("creep-over-10", "friction that sticks the better", "ground"), on(**creep)
    if ground.has_friction:
        smooth = case("friction-0", "without friction nothing holds the stance foot", "ground", STOPS)
        yield smooth, on(static_friction=0.0, dynamic_friction=0.0)

    def solved(rtol: float, atol: float) -> Config:
        return changed(config, "solver.contact", {"rtol": rtol, "atol": atol})

    loose = case("loose", "ordinary library tolerances", "numerics", agreement=0.05, balance=1e-3)
    yield loose, solved(1e-3, 1e-5)
    tight = case("tight", "three digits tighter than needed", "numerics", agreement=1e-6, balance=1e-9)
    yield tight, solved(1e-10, 1e-12)
    yield case("no-budget", "no step fits into it", "numerics", ("budget-exhausted",), budget=FAR_TOO_FEW), config


def start_cases(config: Config) -> Iterator[Judged]:
    """Other slopes and other starts of the contact model."""
    relative = "from the same start relative to the slope"
    yield case("level", f"nothing gives back what impacts take; {relative}", "slopes"), on_slope(config, 0.0)
    yield case("twice-as-steep", relative, "slopes"), on_slope(config, 2.0 * config.slope_rad)
    still = case("standing-still", "both feet down and at rest, it takes no step downhill", "starts", STOPS)
    yield still, at_rates(config, 0.0)
    yield case("twice-as-fast", "pushed off at twice the speed", "starts"), at_rates(config, 2.0)


def knee_cases(config: Config) -> Iterator[Judged]:
    """The knees' other instant of release, and their stops if they have some; nothing for straight legs."""
    walker = config.walker
    knees = isinstance(walker, Kneed) or (isinstance(walker, PartsWalker) and any(one.locks for one in walker.hinges))
    if not knees or not isinstance(walker, Kneed | PartsWalker):
        return

    def with_knee(**changes: Any) -> Config:
        return changed(config, "walker.knee", changes)

    other = "touch" if walker.knee.release == "compression" else "compression"
    yield case(f"released-at-{other}", "the other instant of release", "knees"), with_knee(release=other)
    if walker.knee.lock == "compliant":
        stiffness = walker.knee.stop_stiffness
        yield case("stop-times-10", "a stiffer stop", "knees"), with_knee(stop_stiffness=STOP * stiffness)
        yield case("stop-over-10", "a softer stop", "knees"), with_knee(stop_stiffness=stiffness / STOP)


def changed(block: B, path: str, changes: Mapping[str, Any]) -> B:
    """A block with some keys of a block inside it, given by its dotted path, set anew."""
    name, _, rest = path.partition(".")
    inner = getattr(block, name)
    inside = changed(inner, rest, changes) if rest else inner.model_copy(update=changes)
    return block.model_copy(update={name: inside})


def case(name: str, reason: str, family: str, expected: tuple[Fate, ...] = ENDS, **settings: Any) -> Case:
    """A case of a scene."""
    given = {"steps": STEPS, "budget": BUDGET, **settings}
    return Case(name=f"scene-{name}", family=family, expected=expected, reason=reason, **given)


def on_slope(config: Config, slope_rad: float) -> Config:
    """The scene on another slope, its start turned along: both feet stand on the ground again."""
    start = config.start
    assert not isinstance(start, str), "the start is spelled out"
    n, turned = len(start) // 2, config.slope_rad - slope_rad
    return config.model_copy(
        update={"slope_rad": slope_rad, "start": (*(angle + turned for angle in start[:n]), *start[n:])}
    )


def at_rates(config: Config, factor: float) -> Config:
    """The scene with its start's velocities scaled."""
    start = config.start
    assert not isinstance(start, str), "the start is spelled out"
    n = len(start) // 2
    return config.model_copy(update={"start": (*start[:n], *(factor * rate for rate in start[n:]))})
