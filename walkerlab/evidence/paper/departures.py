"""Differences from the scene of the paper. If there are any, a config's numbers neither confirm nor refute
the paper's.
"""

from collections.abc import Iterable, Iterator
from typing import Any, Final

from walkerlab.config.contact import BOUNDS_SI, Contact
from walkerlab.config.drives import acting_on
from walkerlab.config.fields import are_equal
from walkerlab.config.reads import CompareConfig
from walkerlab.config.schema import Config
from walkerlab.config.walkers import CompassWalker
from walkerlab.evidence.paper.measured import Departures
from walkerlab.evidence.paper.printed import X_P, slope_of

CONTACT_MODEL_KEYS: Final = ("foot_radius_m",)
SI_KEYS: Final = ("stiffness", "damping", *BOUNDS_SI)
"""Keys of the contact block whose values depend on the block's units."""
UNITLESS_KEYS: Final = tuple(name for name in Contact.model_fields if name not in (*SI_KEYS, "units", "stance"))
"""Remaining keys of the contact block. `stance` is left out, because the paper also pins the first stance foot."""


def departures(config: CompareConfig, start_moved: bool) -> Departures:
    """Describe the differences from the paper's scene. Slopes that agree within the rounding of x_p count as equal."""
    walker = config.walker
    contact = config.contact
    paper = CompassWalker()
    rigid: list[str] = []
    of_contact: list[str] = []
    if acting := acting_on(config):
        rigid.append(f"the walker has {' and '.join(acting)}")
    if not config.ground.even:
        rigid.append("the ground is uneven")
    if not isinstance(walker, CompassWalker):
        rigid.append(describe("walker.type", walker.type, paper.type))
    else:
        compass = [name for name in CompassWalker.model_fields if name not in (*CONTACT_MODEL_KEYS, "hip")]
        rigid += [
            *describe_differences(walker, paper, compass),
            *describe_differences(config, Config(), ["gravity_m_s2"]),
        ]
        slope, rounding = slope_of(*X_P[:2])
        if abs(config.slope_rad - slope) > rounding:
            rigid.append(describe("slope_rad", config.slope_rad, slope))
        if contact is not None:
            of_contact += describe_differences(walker, paper, CONTACT_MODEL_KEYS)
            of_contact += describe_differences(contact.to_si(), Contact().to_si(), SI_KEYS, "contact.{} (SI)")
            of_contact += describe_differences(contact, Contact(), UNITLESS_KEYS, "contact.{}")
    if start_moved:
        of_contact.append("the start is not the rigid model's fixed point")
    return Departures(tuple(rigid), (*rigid, *of_contact))


def describe_differences(used: Any, paper: Any, names: Iterable[str], called: str = "{}") -> Iterator[str]:
    for name in names:
        if not are_equal(getattr(used, name), getattr(paper, name)):
            yield describe(called.format(name), getattr(used, name), getattr(paper, name))


def describe(name: str, *values: Any) -> str:
    used, paper = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in values)
    return f"{name} {used} instead of {paper}"
