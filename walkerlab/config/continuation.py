"""The continuation block: the parameter and range over which gaits are followed, and the depth of the cascade."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import create_model

from walkerlab.config.fields import Block, check_against, key

FollowedModel = Literal["rigid", "contact", "both"]
_UNIT: Final = "unit of the key"


if TYPE_CHECKING:

    class _Span(Block):
        """Range of values, with the keys `from` and `to`."""

else:
    # `from` is a keyword of Python, so a class body cannot declare it
    _Span = create_model(
        "_Span",
        __base__=Block,
        __validators__={
            "above": check_against(
                "to", "from", lambda to, least: "" if to > least else f"must be above `from`, {least:g}"
            )
        },
        **{
            "from": (float, key(1.0e-4, _UNIT, "start of the range", bounds="a number below `to`")),
            "to": (float, key(0.1, _UNIT, "end of the range", bounds="a number above `from`")),
        },
    )


class Span(_Span):
    """Config key and the range over which it varies."""

    over: str = key(
        "slope_rad",
        "",
        "parameter to vary, such as slope_deg or walker.hip_mass_kg",
        bounds="dotted path of a config key",
        pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$",
    )

    @property
    def least(self) -> float:
        return float(getattr(self, "from"))

    @property
    def most(self) -> float:
        value: Any = getattr(self, "to")  # noqa: B009 - declared above, where the type checker cannot see it
        return float(value)


class Continuation(Span):
    """Options of `walkerlab continuation`."""

    model: FollowedModel = key("rigid", "", "model whose gaits are followed: rigid, contact, or both on the same axes")
    periods: int = key(16, "1", "period-doubling cascades are followed up to gaits of this many steps", ge=1, le=64)
    points: int = key(400, "1", "maximum number of points on one branch", ge=2, le=100_000)
    second: Span | None = key(None, "", "second parameter, for fold and flip curves in the plane of both")
