"""The design block: the gait quantity to optimise and the parameters to vary."""

from typing import Final, Literal, get_args

from pydantic import field_validator

from walkerlab.config.fields import Block, check_against, key, meaning_error

Quantity = Literal[
    "period_s",
    "step_length_m",
    "speed_m_s",
    "spectral_radius",
    "gait_sensitivity_norm",
    "gait_sensitivity_norm_scaled",
    "cost_of_transport",
    "largest_step_down_m",
    "largest_step_up_m",
    "largest_push_forward_N_s",
    "largest_push_backward_N_s",
]
_NAMES: Final = ", ".join(get_args(Quantity))
Bounds = dict[str, list[float]]


class Design(Block):
    """Optimisation problem of `walkerlab design`."""

    minimise: Quantity | None = key(None, "", "gait quantity to minimise")
    maximise: Quantity | None = key(None, "", "gait quantity to maximise")
    over: Bounds = key(
        dict,
        "",
        "parameters that may vary, with their bounds, in the key's unit",
        bounds="[A, B] for each key, A below B",
    )
    keep: Bounds = key(dict, "", "gait quantities to constrain", bounds=f"[A, B] for each of {_NAMES}")
    model: Literal["rigid", "contact"] = key("rigid", "", "model whose gait is optimised")
    starts: int = key(
        5, "1", "starting points of the search: the config's own values, the rest at random", ge=1, le=1000
    )

    _single_goal = check_against(
        "maximise", "minimise", lambda value, _: "cannot be combined with minimise: remove one of them" if value else ""
    )

    @field_validator("over", "keep")
    @classmethod
    def _upwards(cls, value: Bounds) -> Bounds:
        for name, bounds in value.items():
            if len(bounds) != 2 or bounds[0] >= bounds[1]:
                text = ", ".join(f"{bound:g}" for bound in bounds)
                raise meaning_error(f"has bounds for {name}, [{text}]: give two numbers, the lower one first")
        return value

    @field_validator("keep")
    @classmethod
    def _numbers_of_a_gait(cls, value: Bounds) -> Bounds:
        for name in value:
            if name not in get_args(Quantity):
                raise meaning_error(f"names {name}, which is not a gait quantity; choose from {_NAMES}")
        return value
