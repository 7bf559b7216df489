"""The blocks `contact` (contact laws, in N, mm, s as in ADAMS dialogs or in SI) and `ground` (heights of footholds
above the slope).
"""

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from walkerlab.config.fields import Block, check_against, check_value, key, meaning_error
from walkerlab.extensions import origin_of, words

MM_PER_M: Final = 1000.0

BOUNDS_SI: Final = {
    "full_damping_penetration": (1e-12, 10.0, "m"),
    "stiction_velocity": (1e-7, 10.0, "m/s"),
    "friction_velocity": (1e-7, 1000.0, "m/s"),
}

_ADAMS = "ADAMS/View default, not given in the paper"
_FIG_4B = "section 4 and Fig. 4b, unit not given"
_SECTION_4 = "section 4"
_FRICTION = _SECTION_4 + origin_of("friction")


def from_mm(numbers: Mapping[str, Any], exponent: float) -> dict[str, Any]:
    return {
        "units": "si",
        "stiffness": numbers["stiffness"] * MM_PER_M**exponent,
        "damping": numbers["damping"] * MM_PER_M,
        **{name: numbers[name] / MM_PER_M for name in BOUNDS_SI},
    }


PadPitch = Annotated[
    Annotated[Literal["rigid", "own"], Tag("word")] | Annotated[float, Field(ge=1e-6, le=1e4), Tag("number")],
    Discriminator(lambda value: "word" if isinstance(value, str) else "number"),
]


class Contact(Block):
    """Contact between feet and ground: normal force, friction, terrain."""

    units: Literal["adams", "si"] = key(
        "adams", "", "adams: values of this block in N, mm, s as in ADAMS dialogs; si: in N, m, s", _SECTION_4
    )
    normal_force: Literal[words("normal_force")] = key(  # type: ignore[valid-type]
        "impact", "", "impact: the IMPACT law of ADAMS; extensions add others", _ADAMS
    )
    stiffness: float = key(1.0e5, "N/mm^e or N/m^e", "k of the normal force k d^e + c(d) d'", _FIG_4B, ge=1e-6, le=1e20)
    exponent: float = key(2.2, "1", "exponent e of the normal force, 1 for a linear spring", _ADAMS, ge=1.0, le=3.0)
    damping: float = key(90.0, "N s/mm or N s/m", "damping c at full_damping_penetration", _FIG_4B, ge=0.0, le=1e12)
    full_damping_penetration: float = key(
        0.1, "mm or m", "penetration at which damping reaches its full value", _ADAMS, bounds="1e-12 to 10 m", gt=0.0
    )
    friction: Literal[words("friction")] = key(  # type: ignore[valid-type]
        "coulomb",
        "",
        "coulomb: creeping Coulomb friction as in ADAMS; none: frictionless ground; extensions add others",
        _FRICTION,
    )
    static_friction: float = key(
        0.9, "1", "coefficient at stiction_velocity, where friction is largest", _SECTION_4, ge=0.0, le=100.0
    )
    dynamic_friction: float = key(
        0.7,
        "1",
        "coefficient beyond friction_velocity",
        _SECTION_4,
        bounds="0 to 100, not above static_friction",
        ge=0.0,
        le=100.0,
    )
    stiction_velocity: float = key(
        100.0, "mm/s or m/s", "slip velocity at which friction is largest", _ADAMS, bounds="1e-7 to 10 m/s", gt=0.0
    )
    friction_velocity: float = key(
        1000.0,
        "mm/s or m/s",
        "slip velocity above which friction is dynamic",
        _ADAMS,
        bounds="above stiction_velocity, up to 1000 m/s",
        gt=0.0,
    )
    terrain: Literal["checkerboard", "after-mid-swing", "plane"] = key(
        "checkerboard",
        "",
        "checkerboard: a lane of raised pads per leg; "
        "after-mid-swing: a swing foot touches only once it has passed the stance foot; "
        "plane: ordinary ground, for feet that clear it",
        _SECTION_4,
    )
    pad_pitch: PadPitch = key(
        "rigid",
        "m",
        "pitch of the checkerboard's pads: step length of the rigid gait (rigid) or of the contact gait (own), or a "
        "length, always in m; no effect on other terrains",
        _SECTION_4,
        bounds="rigid, own, or 1e-6 to 1e4",
    )
    stance: Literal["free", "pinned"] = key(
        "free", "", "pinned: a revolute joint at the first stance foot until the first heel strike", _SECTION_4
    )

    @model_validator(mode="before")
    @classmethod
    def _default_quantities_in_si(cls, data: Any) -> Any:
        """Convert the defaults to the block's units, so that an omitted key means the same physical value in both
        systems."""
        if not isinstance(data, dict) or data.get("units") != "si":
            return data
        exponent = data.get("exponent", 2.2)
        # An invalid exponent is reported when the schema is checked. Until then, any valid one can replace it.
        power = float(exponent) if isinstance(exponent, int | float) and 1.0 <= exponent <= 3.0 else 2.2
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        return from_mm(defaults, power) | data

    _above = check_against(
        "friction_velocity",
        "stiction_velocity",
        lambda value, least: "" if value > least else f"must exceed stiction_velocity, {least:g}",
    )
    _below = check_against(
        "dynamic_friction",
        "static_friction",
        lambda value, most: "" if value <= most else f"must not exceed static_friction, {most:g}",
    )

    @field_validator(*BOUNDS_SI)
    @classmethod
    def _check_bounds(cls, value: float, info: ValidationInfo) -> float:
        """Check a length or velocity against its bounds, converted to the block's units."""
        units = info.data.get("units", "adams")
        scale, prefix = (MM_PER_M, "m") if units == "adams" else (1.0, "")
        least, most, unit = BOUNDS_SI[str(info.field_name)]
        if least * scale <= value <= most * scale:
            return value
        raise meaning_error(f"must be from {least * scale:g} to {most * scale:g} {prefix}{unit}, with `units: {units}`")

    @property
    def has_friction(self) -> bool:
        return bool(self.friction != "none")

    def unit_of(self, either: str) -> str:
        """Return the unit that this block uses. `either` names the two possible ones, as in `mm or m`."""
        return either.split(" or ")[-1 if self.units == "si" else 0]

    def to_si(self) -> Self:
        return self if self.units == "si" else self.model_copy(update=from_mm(vars(self), self.exponent))


def why_two_sources(heights: tuple[float, ...], roughness: float) -> str:
    """Explain why heights cannot be combined with a roughness, or return '' if only one of them is given."""
    return "cannot be combined with roughness_m: heights are either listed or drawn" if heights and roughness else ""


def why_too_high(heights: tuple[float, ...]) -> str:
    """Explain why heights are not allowed, or return '' if they are."""
    return "must be numbers from -1e3 to 1e3" if any(abs(height) > 1e3 for height in heights) else ""


class Footholds(Block):
    """Heights of the footholds, for uneven ground. The default is even ground."""

    roughness_m: float = key(
        0.0, "m", "standard deviation of the footholds' heights, which are drawn independently", ge=0.0, le=1e3
    )
    seed: int = key(0, "1", "seed of the random heights", ge=0, le=2**32 - 1)
    heights_m: tuple[float, ...] = key(
        (),
        "m",
        "heights of footholds 1, 2, … above the slope, along the slope's normal; later footholds have the last height",
        bounds="a list of numbers from -1e3 to 1e3, in place of roughness_m",
    )

    _listed = check_against("heights_m", "roughness_m", why_two_sources)
    _heights = check_value("heights_m", why=why_too_high)

    @property
    def even(self) -> bool:
        return self.roughness_m == 0.0 and not any(self.heights_m)
