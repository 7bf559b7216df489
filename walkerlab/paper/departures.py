"""In what a config's scene is not the one of the paper: then its numbers neither confirm nor refute the paper's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any, Final

from walkerlab.config.contact import Contact
from walkerlab.config.numbers import same
from walkerlab.config.reads import ContactConfig, RigidConfig
from walkerlab.config.schema import Config
from walkerlab.config.walkers import CompassWalker
from walkerlab.paper.measured import Departures
from walkerlab.paper.printed import X_P, slope_of

PHYSICAL_MODEL_ONLY: Final = ("foot_radius_m",)
LAWS: Final = ("friction", "terrain", "pad_pitch")
"""Keys of the contact block besides its force laws. A pinned first stance is the paper's too (section 4)."""


def departures(config: ContactConfig, start_moved: bool) -> Departures:
    """What differs from the paper's scene, in words.

    start_moved  the walk did not start from the rigid model's fixed point
    """
    of_rigid = tuple(of_the_rigid_model(config))
    moved = ("the start is not the rigid model's fixed point",) if start_moved else ()
    walker, contact = config.walker, config.contact
    of_contact: tuple[str, ...] = ()
    if contact is not None and isinstance(walker, CompassWalker):
        of_contact = tuple(of_the_contact(walker, contact))
    return Departures(of_rigid, (*of_rigid, *of_contact, *moved))


def of_the_rigid_model(config: RigidConfig) -> Iterator[str]:
    """Walker, gravity and slope; the slope is known to the digits of x_p."""
    if not isinstance(config.walker, CompassWalker):
        yield said("walker.type", config.walker.type, CompassWalker().type)
        return
    compass = [name for name in CompassWalker.model_fields if name not in PHYSICAL_MODEL_ONLY]
    yield from different(config.walker, CompassWalker(), compass)
    yield from different(config, Config(), ["gravity_m_s2"])
    slope, rounding = slope_of(*X_P[:2])
    if abs(config.slope_rad - slope) > rounding:
        yield said("slope_rad", config.slope_rad, slope)


def of_the_contact(walker: CompassWalker, contact: Contact) -> Iterator[str]:
    """Foot, force laws and terrain."""
    laws, paper = contact.in_si(), Contact()
    yield from different(walker, CompassWalker(), PHYSICAL_MODEL_ONLY)
    yield from different(laws, paper.in_si(), [field.name for field in fields(laws)])
    for name in LAWS:
        if getattr(contact, name) != getattr(paper, name):
            yield said(f"contact.{name}", getattr(contact, name), getattr(paper, name))


def different(used: Any, paper: Any, names: Iterable[str]) -> Iterator[str]:
    """The names by which the two have different values."""
    for name in names:
        if not same(getattr(used, name), getattr(paper, name)):
            yield said(name, getattr(used, name), getattr(paper, name))


def said(name: str, *values: Any) -> str:
    """A difference in words."""
    used, paper = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in values)
    return f"{name} {used} instead of {paper}"
