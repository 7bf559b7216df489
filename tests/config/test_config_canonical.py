"""What a stage sees of a config, and what its key is made of."""

import json
import math

import pytest

from walkerlab.config.canonical import canonical_json, only, slice_of
from walkerlab.config.fields import leaves
from walkerlab.config.schema import Config, Contact

CONFIG = Config(contact=Contact())


def test_a_slice_holds_what_is_declared_and_nothing_else() -> None:
    part = slice_of(CONFIG, ("slope", "solver.rigid", "contact.units", "outputs"))
    assert part == {
        "slope_rad": 0.0174,
        "solver": {"rigid": {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}},
        "contact": {"units": "adams"},
        "outputs": ["states", "energies", "forces"],
    }


def test_two_keys_of_one_block_are_both_in_the_slice() -> None:
    part = slice_of(CONFIG, ("solver.rigid.rtol", "solver.contact.rtol"))
    assert part == {"solver": {"rigid": {"rtol": 1e-10}, "contact": {"rtol": 1e-7}}}


def test_a_block_that_is_left_out_is_none_in_the_slice() -> None:
    assert slice_of(Config(), ("contact",)) == slice_of(Config(), ("contact.units",)) == {"contact": None}


def test_a_slice_does_not_depend_on_the_order_of_declaration() -> None:
    one, other = slice_of(CONFIG, ("walker", "slope")), slice_of(CONFIG, ("slope_rad", "walker"))
    assert canonical_json(one) == canonical_json(other)


def test_every_key_can_be_sliced_and_all_of_them_are_the_config() -> None:
    everything = slice_of(CONFIG, tuple(".".join(path) for path, _ in leaves(Config)))
    assert everything == CONFIG.model_dump(mode="json")


def test_a_key_that_does_not_exist_is_a_bug() -> None:
    with pytest.raises(AttributeError, match=r"no key 'solver\.rigit'"):
        slice_of(CONFIG, ("solver.rigit",))
    with pytest.raises(AttributeError, match=r"no key 'slope_rad\.x'"):
        only(CONFIG, ("slope_rad.x",))


def test_canonical_json_is_one_text_for_one_content() -> None:
    assert canonical_json({"b": 1e-10, "a": [0.1, "θ"]}) == '{"a":[0.1,"\\u03b8"],"b":1e-10}'
    assert json.loads(canonical_json({"x": 0.1 + 0.2}))["x"] == 0.1 + 0.2
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical_json(math.nan)


def test_a_view_shows_declared_keys_as_the_config_has_them() -> None:
    view = only(CONFIG, ("walker", "solver.rigid", "slope", "contact"))
    assert view.walker is CONFIG.walker
    assert view.solver.rigid is CONFIG.solver.rigid
    assert view.slope_rad == 0.0174
    assert view.contact is not None
    assert view.contact.in_si() == Contact().in_si()


def test_a_view_of_a_left_out_block_is_none() -> None:
    assert only(Config(), ("contact.units",)).contact is None


@pytest.mark.parametrize("key", ["strides", "solver.contact", "contact.stiffness", "contact.in_si"])
def test_reading_an_undeclared_key_is_a_bug_that_names_it(key: str) -> None:
    view = only(CONFIG, ("walker", "solver.rigid", "contact.units"))
    *blocks, name = key.split(".")
    for block in blocks:
        view = getattr(view, block)
    with pytest.raises(AttributeError, match=f"'{key}' is not declared .* contact.units, solver.rigid, walker"):
        getattr(view, name)
