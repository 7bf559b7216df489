"""Check for every type of walker that each number of the schema is a parameter or is rejected with a reason."""

from pathlib import Path

import pytest

from walkerlab.config.fields import describe_type, leaves, leaves_of_other_kinds
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.pipeline.sweeps.question import axis, described
from walkerlab.scene.contact import contact_scene
from walkerlab.scene.parameter import MODEL_KEYS, parameter_of
from walkerlab.scene.rigid import rigid_walker

TORSO = "walker.torso={mass_kg: 3, above_hip_m: 0.3}"
WALKERS = {
    "paper": (),
    "rigid-only": (),
    "torso": (),
    "round-feet": (),
    "kneed": (),
    "kneed with torso": (TORSO,),
    "kneed with compliant stops": ("walker.knee.lock=compliant",),
    "parts": (),
    "paper, own pitch": ("contact.pad_pitch=own",),
}
EVERY = sorted({
    *(".".join(path) for path, _ in leaves(Config)),
    *(".".join(("walker", *path[1:])) for path, _ in leaves_of_other_kinds(Config)),
    "slope_deg", "walker", "walker.torso", "walker.thigh", "contact", "walker.leg_mas_kg", "no.such.key",
    "walker.bodies",
})  # fmt: skip


@pytest.fixture(scope="module", params=WALKERS)
def config(request):
    return load(Path(request.param.split(",")[0].split(" ")[0]), WALKERS[request.param]).config


def numbers_of(config, second_leg=False):
    """Return the keys of the config's walker whose values, in it or in its first leg, are numbers."""
    for path, field in leaves(Config, held=config):
        held = config
        for name in path:
            if name != "leg_2" or not second_leg:
                held = getattr(held, name, None)
        if path[0] in MODEL_KEYS and "number" in describe_type(field.annotation) and isinstance(held, int | float):
            yield ".".join(path)


def test_parameters_are_exactly_the_numeric_keys_of_the_walker(config):
    own = {*numbers_of(config, second_leg=True), "slope_deg"}
    for key in EVERY:
        if key in own:
            assert parameter_of(key, config).key == key
        else:
            with pytest.raises(ConfigError) as caught:
                parameter_of(key, config)
            assert str(caught.value).startswith(key)
            assert caught.value.advice


def test_every_parameter_can_be_changed_by_a_thousandth(config):
    for key in (*numbers_of(config), "slope_deg"):
        parameter = parameter_of(key, config)
        value = parameter.value_in(config)
        changed = parameter.config_at(config, 1.001 * value if value else 1e-3)
        if changed is None:  # The new value violates a bound that depends on another value.
            changed = parameter.config_at(config, 0.999 * value)
        if (config.walker.type, key) == ("parts", "walker.leg_length_m"):
            assert changed is None  # The parts determine this value.
            continue
        assert changed is not None, key
        assert parameter.value_in(changed) != value
        rigid_walker(changed, changed.equations)
        if changed.contact is not None:
            contact_scene(changed, 0.4, 0.4)


def test_setting_a_parameter_to_its_current_value_leaves_the_walker_unchanged(config):
    for key in (*numbers_of(config), "slope_deg"):
        parameter = parameter_of(key, config)
        again = parameter.config_at(config, parameter.value_in(config))
        assert rigid_walker(again, again.equations) == rigid_walker(config, config.equations)


@pytest.mark.parametrize(
    ("name", "key", "said"),
    [
        ("paper", "walker.torso.mass_kg", "cannot be used: the config has no block walker.torso; add it first"),
        (
            "paper",
            "walker.thigh.mass_kg",
            "is not a key of this walker, whose type is compass; did you mean walker.hip_mass_kg",
        ),
        ("kneed", "walker.foot_to_mass_m", "is not a key of this walker, whose type is kneed"),
        ("parts", "walker.bodies.mass_kg", "has one value for each of walker.bodies, so it is not a single number"),
        ("rigid-only", "contact.stiffness", "cannot be used: the config has no block contact; add it first"),
        ("paper", "walker.torso", "is a block of keys, not a number"),
        ("paper", "strides", "affects no model"),
        ("paper", "contact.terrain", "is not a number"),
    ],
)
def test_key_that_cannot_be_continued_is_rejected_with_a_reason(name, key, said):
    with pytest.raises(ConfigError) as caught:
        parameter_of(key, load(Path(name)).config)
    assert f"{key} {said}" in str(caught.value)


def test_sweep_accepts_every_parameter_of_a_walker(config):
    for key in numbers_of(config):
        value = parameter_of(key, config).value_in(config)
        one = axis(key, f"{value}:{value + 1e-3}:2", f"--over {key}")
        assert one.values == pytest.approx((value, value + 1e-3))
        assert described(config, key)[1] != key, "its meaning is known"
