"""The plan block: how a walk would be measured, for `walkerlab identify --plan`."""

from pydantic import field_validator

from walkerlab.config.fields import Block, key, meaning_error


class Plan(Block):
    """Measurements to plan, with their assumed noise."""

    steps: int = key(20, "1", "steps of the walk for which standard errors are reported", ge=2, le=500)
    max_steps: int = key(50, "1", "steps of the longest walk to consider", ge=2, le=500)
    errors: dict[str, float] = key(
        dict, "", "standard errors to reach, in the key's unit", bounds="a number above 0 for each key of identify.fit"
    )
    period_noise_s: float = key(2e-3, "s", "standard deviation of a measured period", gt=0.0, le=1.0)
    length_noise_m: float = key(2e-3, "m", "standard deviation of a measured step length", gt=0.0, le=1.0)
    angle_noise_rad: float = key(2e-3, "rad", "standard deviation of a measured angle", gt=0.0, le=1.0)
    rate_hz: float = key(100.0, "Hz", "sampling rate of angles over time", ge=1.0, le=10_000.0)
    roughness_m: float = key(1e-4, "m", "standard deviation of the floor's heights", ge=0.0, le=0.1)
    start_change: float = key(
        0.02, "1", "relative change of the start's coordinates, for walks that do not start on the gait", gt=0.0, le=0.5
    )

    @field_validator("errors")
    @classmethod
    def _positive(cls, value: dict[str, float]) -> dict[str, float]:
        for name, error in value.items():
            if not error > 0.0:
                raise meaning_error(f"has {error:g} for {name}, not a number above 0")
        return value
