"""The identify block: a measured walk, and the parameters to estimate from it."""

from typing import Any, Final, Literal, get_args

from pydantic import field_validator

from walkerlab.config.fields import Text, check_against, check_entries, key, listed, why_not_rising
from walkerlab.config.recording import Recorded

Nuisance = Literal["time_offset_s", "clock_rate", "angle_offset_rad", "angle_gain"]
OFFSET: Final = "angle_offset_rad"
Pair = list[float]


def why_two_offsets(nuisance: tuple[Nuisance, ...], tilt: Any) -> str:
    """Explain why an offset of the angles would be estimated twice, or return '' if it is not."""
    twice = tilt == "free" and OFFSET in nuisance
    return f"has {OFFSET}, which camera_tilt_deg: free estimates already: leave out one of both" if twice else ""


def why_no_deviation(name: str, pair: Pair) -> str:
    """Explain why the prior of `name` is not a value and a standard deviation, or return '' if it is."""
    good = len(pair) == 2 and pair[1] > 0.0
    return "" if good else f"has [{listed(pair)}] for {name}, not a value and a standard deviation above 0"


class Identify(Recorded):
    """Estimation problem of `walkerlab identify`."""

    data: Text = key(
        "", "", "file with the measured walk", bounds="a path, relative to the current folder", default_in_words="none"
    )
    level: Literal["steps", "angles"] = key(
        "steps", "", "steps: period (and length and touch angle if measured) of each step; angles: leg angles over time"
    )
    fit: dict[str, Pair | None] = key(
        dict,
        "",
        "parameters to estimate, with their bounds in the key's unit",
        bounds="[A, B] for each key, A below B, or null for the schema's bounds",
    )
    prior: dict[str, Pair] = key(
        dict,
        "",
        "parameters that were measured by other means, in the key's unit",
        bounds="[value, standard deviation] for each key, with a standard deviation above 0",
    )
    first_leg: Literal[1, 2] | None = key(
        None,
        "",
        "leg that swings in the first step of a table of steps, if the legs differ",
        default_in_words="both are tried",
    )
    nuisance: tuple[Nuisance, ...] = key(
        (),
        "",
        "clock and sensor properties to estimate as well; time_offset_s counts from the first heel strike",
        bounds=f"a list of {', '.join(get_args(Nuisance))}",
    )
    model: Literal["rigid", "contact", "both"] = key("rigid", "", "model to fit")
    starts: int = key(
        1, "1", "number of starts of the fit: the config's values first, then values within 10 % of them", ge=1, le=100
    )
    max_walks: int = key(
        10_000,
        "1",
        "maximum number of predicted walks before a fit ends without convergence",
        ge=1,
        le=10_000_000,
    )
    robustness: bool = key(
        False,
        "",
        "whether to report the identified gait's sensitivity norm (change of the step period for a drop of the floor)",
    )
    loss: Literal["linear", "soft_l1"] = key(
        "linear", "", "linear: least squares; soft_l1: outliers count in proportion to their size, not its square"
    )
    _one_offset = check_against("nuisance", "camera_tilt_deg", why_two_offsets)

    @property
    def sensors(self) -> tuple[Nuisance, ...]:
        """Properties of clock and sensors to estimate.

        A freely tilted camera adds an offset to all angles. So does measuring from the floor's normal if the slope is
        estimated.
        """
        follows = self.camera_tilt_deg == "floor" and self.level == "angles" and "slope_deg" in self.keys
        return tuple(dict.fromkeys((*self.nuisance, *((OFFSET,) if follows or self.camera_tilt_deg == "free" else ()))))

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of all parameters to estimate: fitted ones, and those with a prior."""
        return tuple(dict.fromkeys((*self.fit, *self.prior)))

    @property
    def models(self) -> tuple[str, ...]:
        return ("rigid", "contact") if self.model == "both" else (self.model,)

    _rising = check_entries("fit", why=why_not_rising)

    _deviations = check_entries("prior", why=why_no_deviation)

    @field_validator("nuisance")
    @classmethod
    def _remove_duplicates(cls, value: tuple[Nuisance, ...]) -> tuple[Nuisance, ...]:
        return tuple(dict.fromkeys(value))
