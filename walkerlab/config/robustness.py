"""The robustness block: disturbances of a gait, and parameters with respect to which it is differentiated."""

from typing import Annotated, Final, Literal

from pydantic import Field

from walkerlab.config.fields import Block, key

_DEFAULT_ROUGHNESS_M: Final = (0.0005, 0.001, 0.002)
Roughness = Annotated[float, Field(gt=0.0, le=1e3)]


class Robustness(Block):
    """Disturbances and parameters of `walkerlab robustness`."""

    model: Literal["rigid", "contact", "both"] | None = key(
        None, "", "which model walks", default_in_words="both, rigid where there is no contact block"
    )
    to: tuple[str, ...] | None = key(
        None,
        "",
        "parameters with respect to which the gait is differentiated; an empty list leaves the derivatives out",
        bounds="a list of dotted paths of config keys",
        default_in_words="every parameter that the model reads",
        sequence=True,
    )
    steps: int = key(50, "1", "steps that a walk must take after a single disturbance", ge=1, le=10_000)
    roughness_m: tuple[Roughness, ...] = key(
        _DEFAULT_ROUGHNESS_M,
        "m",
        "standard deviations of the footholds' heights; an empty list leaves rough ground out",
        bounds="a list of numbers above 0",
    )
    walks: int = key(400, "1", "walks per roughness", ge=2, le=1_000_000)
    max_steps: int = key(20_000, "1", "steps after which a walk on rough ground is cut off", ge=1, le=10_000_000)
