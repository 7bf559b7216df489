"""The continuation block: over which key gaits are followed, from where to where, and how far down the cascade."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import create_model

from walkerlab.config.fields import Block, check_against, key

FollowedModel = Literal["rigid", "contact", "both"]
_UNIT: Final = "that of the key"


if TYPE_CHECKING:

    class _Span(Block):
        """A range of values; its keys are `from` and `to`."""

else:
    # `from` is a word of the language, and so a class body cannot declare it
    _Span = create_model(
        "_Span",
        __base__=Block,
        __validators__={
            "above": check_against(
                "to", "from", lambda to, least: "" if to > least else f"must be above `from`, {least:g}"
            )
        },
        **{
            "from": (float, key(1.0e-4, _UNIT, "where the span begins", bounds="a number below `to`")),
            "to": (float, key(0.1, _UNIT, "where the span ends", bounds="a number above `from`")),
        },
    )


class Span(_Span):
    """A key and a range of its values."""

    over: str = key(
        "slope_rad",
        "",
        "key of the config that changes, a number such as slope_deg or walker.hip_mass_kg",
        bounds="a key with its blocks, dotted",
        pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$",
    )

    @property
    def least(self) -> float:
        """Where the span begins, in the unit of the key."""
        return float(getattr(self, "from"))

    @property
    def most(self) -> float:
        """Where the span ends, in the unit of the key."""
        found: Any = getattr(self, "to")  # noqa: B009 - declared above, out of the type checker's sight
        return float(found)


class Continuation(Span):
    """What `walkerlab continuation` follows."""

    model: FollowedModel = key("rigid", "", "which model's gaits: rigid, contact, or both on the same axes")
    periods: int = key(16, "1", "steps of the longest gaits that the cascade is followed to", ge=1, le=64)
    points: int = key(400, "1", "points of one branch, at most", ge=2, le=100_000)
    second: Span | None = key(None, "", "a second key, for the curves of folds and flips in the plane of both")
