"""The ground block: heights of footholds above the slope."""

from pydantic import field_validator

from walkerlab.config.fields import Block, check_against, key, meaning_error


class Footholds(Block):
    """Heights of the footholds, for uneven ground. The default is even ground."""

    roughness_m: float = key(
        0.0, "m", "standard deviation of the footholds' heights, which are drawn independently", ge=0.0, le=1e3
    )
    seed: int = key(0, "1", "seed of the random heights", ge=0, le=2**32 - 1)
    heights_m: tuple[float, ...] = key(
        (),
        "m",
        "heights of footholds 1, 2, … above the slope, along its normal; later footholds have the last height",
        bounds="a list of numbers from -1e3 to 1e3, in place of roughness_m",
    )

    _listed = check_against(
        "heights_m",
        "roughness_m",
        lambda heights, roughness: (
            "cannot be combined with roughness_m: heights are either listed or drawn" if heights and roughness else ""
        ),
    )

    @field_validator("heights_m")
    @classmethod
    def _check_heights(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if any(abs(height) > 1e3 for height in value):
            raise meaning_error("must be numbers from -1e3 to 1e3")
        return value

    @property
    def even(self) -> bool:
        return self.roughness_m == 0.0 and not any(self.heights_m)
