"""List the computations that the scene of a config makes unnecessary, with reasons and savings.

The list follows from the config alone, so it is available before anything is loaded or run. scripts/benchmark.py
measures the savings in time and bytes (docs/performance.md).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactSimConfig, RigidConfig, SimulateConfig
    from walkerlab.config.schema import Output
    from walkerlab.config.walkers import Walker

# Reasons why a figure or page drawn early lacks a result.
STILL_COMPUTED = "still being computed"
STOPPED = "the command was stopped"


@dataclass(frozen=True)
class LeftOut:
    what: str
    why: str
    saves: str = ""


# `LeftOut` as stored in summaries.
Entry = dict[str, str]
# Number of values per sample, by output.
RIGID_NUMBERS: "Mapping[Output, int]" = {"states": 10, "energies": 3, "forces": 4}
CONTACT_NUMBERS: "Mapping[Output, int]" = {"states": 10, "energies": 8, "forces": 8}


def rigid_walk_omissions(config: "SimulateConfig") -> tuple[Entry, ...]:
    return (stance_omission(config), *leg_omissions(config), *output_omissions(config.outputs, "rigid", RIGID_NUMBERS))


def stance_omission(config: "RigidConfig") -> Entry:
    """Describe what the rigid model omits at the stance foot. The foot of a compass is a point, but others may roll."""
    if config.walker.type == "compass":
        return omission(
            "floating base, stance contact and foot radius of the rigid walk",
            "its stance foot is pinned, its feet are points",
            "4 of 8 equations, all contact code",
        )
    return omission(
        "floating base and stance contact of the rigid walk",
        "its stance foot turns on its point or rolls without slip",
        "4 equations, all contact code",
    )


def contact_walk_omissions(config: "ContactSimConfig") -> tuple[Entry, ...]:
    contact = config.contact
    omissions = [omission("force law of a foot in the air", "no ground touches it", "one of two force laws in a swing")]
    if contact is not None and not contact.has_friction:
        saved = "4 of a foot's 9 event functions, and the friction law"
        omissions.append(omission("tangential velocity and friction force", "contact.friction is none", saved))
    if contact is not None and contact.stance == "pinned":
        angles = count_step_angles(config.walker)
        what = "floating base and stance contact in the first step"
        saved = f"4 of {2 * angles + 4} equations and both force laws in that step"
        omissions.append(omission(what, f"contact.stance is pinned: {angles} angles suffice", saved))
    if config.walker.foot_radius_m == 0.0:
        saved = "nothing: zeros cost the same time"
        omissions.append(omission("terms of the foot radius", "walker.foot_radius_m is 0", saved))
    return (*omissions, *leg_omissions(config), *output_omissions(config.outputs, "contact", CONTACT_NUMBERS))


def count_step_angles(walker: "Walker") -> int:
    """Count the angles during a step. With a compliant knee stop, the stance shank also has one."""
    from walkerlab.config.walkers import Kneed, rigid_bodies  # imported here to keep the help fast

    return rigid_bodies(walker) + int(isinstance(walker, Kneed) and walker.knee.lock == "compliant")


def leg_omissions(config: "RigidConfig") -> Iterator[Entry]:
    if getattr(config.walker, "leg_inertia_kg_m2", None) == 0.0:
        saved = "nothing: its terms are constants, summed before the walk starts"
        yield omission("leg inertia", "walker.leg_inertia_kg_m2 is 0", saved)


def output_omissions(outputs: "tuple[Output, ...]", model: str, numbers: "Mapping[Output, int]") -> Iterator[Entry]:
    for output, count in numbers.items():
        if output not in outputs:
            what = f"{output} of the {model} walk in time"
            reason = f"{output} are not in `outputs`"
            yield omission(what, reason, f"{count} of {sum(numbers.values())} values per sample")
    if not outputs:
        yield omission(f"samples of the {model} walk", "`outputs` is empty", "all states during steps")


def omission(what: str, why: str, saves: str) -> Entry:
    return {"what": what, "why": why, "saves": saves}
