"""Check the parameters, priors and model of the `identify` block, for the stages `identify` and `plan`."""

from collections.abc import Mapping, Sequence
from typing import Final

from walkerlab.config import identify, reads, walkers
from walkerlab.errors import ConfigError
from walkerlab.scene import identification, subject
from walkerlab.scene.parameter import parameter_of

EXACT_PRIOR: Final = 1e-9  # a prior whose standard deviation is below this fraction of its value counts as exact


def refuse_model(config: reads.ContactConfig, block: identify.Identify) -> None:
    """Raise ConfigError if the contact model is requested and the config has no contact block."""
    if "contact" in block.models and config.contact is None:
        raise walkers.contact_required_error(f"identify.model: {block.model}", config.walker, "Add one.")


def refuse_keys(config: reads.ContactConfig, block: identify.Identify) -> None:
    """Raise ConfigError for a key that is not a parameter of the models, and for a value or prior that cannot be
    used."""
    refuse_values(config, "fit", block.fit, block.models)
    refuse_values(config, "prior", {key: pair[:1] for key, pair in block.prior.items()}, block.models)
    for key, (value, sigma) in block.prior.items():
        if sigma < EXACT_PRIOR * (abs(value) or identification.SCALE_OF_ZERO):
            raise ConfigError(
                f"identify.prior: {key} has a standard deviation of {sigma:g}, too small for its value, {value:g}.",
                f"A value that is known exactly belongs in the config (--set {key}={value:g}), without --prior.",
                ("identify", "prior"),
            )


def refuse_values(
    config: reads.ContactConfig, where: str, values: Mapping[str, Sequence[float] | None], models: Sequence[str]
) -> None:
    asker = ("identify", where)
    for key, bounds in values.items():
        parameter = parameter_of(key, config, asker)
        subject.refuse_unread(".".join(asker), key, config, models)
        for value in bounds or ():
            if parameter.config_at(config, value) is None:
                raise parameter.refusal(config, value, asker)
        if bounds is not None and len(bounds) > 1 and not bounds[0] <= parameter.value_in(config) <= bounds[1]:
            raise ConfigError(
                f"{'.'.join(asker)}: {key} starts at {parameter.value_in(config):g} {parameter.unit}, outside its "
                f"bounds {bounds[0]:g} to {bounds[1]:g}",
                "Widen the bounds, or change the start (--set).",
                asker,
            )
