"""The catalogue of a scene's own extremes: its walker on harder and softer ground, other slopes, from other starts."""

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
ENDS: tuple[Fate, ...] = tuple(fate for fate in FATES if fate not in ("budget-exhausted", "solver-failed", "rejected"))
"""The ends that physics may have: where nobody knows which, a case passes by its measures alone."""
STOPS: tuple[Fate, ...] = tuple(fate for fate in ENDS if fate != "walked")
SOFTER, STICKIER = 100.0, 10.0
STOP = 10.0

Judged = tuple[Case, Config]
B = TypeVar("B", bound=Block)


def scene_cases(config: Config) -> list[Judged]:
    """The cases of a scene, each with its config: of the rigid model, and of the contact model where there is ground.

    config  with the start spelled out in numbers, and the pads' pitch if there are pads
    """
    still, steep = with_start(config, 0.0), with_start(config, 1.0, 2.0 * config.slope_rad)
    relative, back = "from the same start relative to the slope", "legs apart and at rest fall back"
    cases = [
        (case("rigid", "the scene's rigid walk", "walkers", model="rigid", steps=10, twin=True), config),
        (case("rigid-twice-as-steep", relative, "slopes", model="rigid"), steep),
        (case("rigid-standing-still", back, "starts", STOPS, model="rigid"), still),
    ]
    if config.contact is None:
        return cases
    level = case("level", f"nothing gives back what impacts take; {relative}", "slopes")
    down = case("standing-still", "both feet down and at rest, it takes no step downhill", "starts", STOPS)
    fast = case("twice-as-fast", "pushed off at twice the speed", "starts")
    cases += [*ground_cases(config, config.contact), *knee_cases(config), (level, with_start(config, 1.0, 0.0))]
    return [*cases, (case("twice-as-steep", relative, "slopes"), steep), (down, still), (fast, with_start(config, 2.0))]


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


def with_start(config: Config, factor: float, slope_rad: float | None = None) -> Config:
    """The scene with its start's velocities scaled; on another slope turned along, so that both feet stand on it."""
    start, slope = config.start, config.slope_rad if slope_rad is None else slope_rad
    assert not isinstance(start, str), "the start is spelled out"
    n, turned = len(start) // 2, config.slope_rad - slope
    angles, rates = (angle + turned for angle in start[:n]), (factor * rate for rate in start[n:])
    return config.model_copy(update={"slope_rad": slope, "start": (*angles, *rates)})
