"""Tests of the slice of a config that each stage reads, and of the key computed from it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Protocol

import pytest

from walkerlab.config import reads, schema
from walkerlab.config.analyses import Basin, Case, Continuation, Design, Robustness
from walkerlab.config.contact import Footholds
from walkerlab.config.drives import PushOff
from walkerlab.config.identify import Identify
from walkerlab.config.reads import (
    ContactConfig,
    SceneConfig,
    SimulateConfig,
    StartConfig,
    canonical_json,
    dotted_keys,
    restrict,
    slice_of,
)
from walkerlab.config.schema import Config, Contact
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.stage import Stage

CONFIG = Config(contact=Contact())


class Tolerance(Protocol):
    @property
    def rtol(self) -> float: ...


class Tolerances(Protocol):
    @property
    def rigid(self) -> Tolerance: ...
    @property
    def contact(self) -> Tolerance: ...


class ToleranceConfig(Protocol):
    @property
    def solver(self) -> Tolerances: ...


class ToleranceThenStart(StartConfig, ToleranceConfig, Protocol):
    """A type that lists its bases in the opposite order of their keys."""


class StartThenTolerance(ToleranceConfig, StartConfig, Protocol):
    """The same keys as `ToleranceThenStart`."""


class MisspeltConfig(Protocol):
    @property
    def slope_deg(self) -> float: ...


@pytest.fixture
def blocks_imported(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let `reads` import the blocks of the config at run time, as some stages do, instead of only for mypy."""
    blocks = (Basin, Case, Contact, Continuation, Design, Footholds, Identify, PushOff, Robustness)
    for block in blocks:
        monkeypatch.setattr(reads, block.__name__, block, raising=False)
    monkeypatch.setattr(reads, "schema", schema, raising=False)
    reads.keys_of.cache_clear()
    yield
    reads.keys_of.cache_clear()


KEYS = {stage.name: stage.reads(CONFIG) for stage in PIPELINE.stages}


@pytest.mark.parametrize("stage", PIPELINE.stages, ids=KEYS)
def test_config_slice_of_a_stage_does_not_depend_on_imported_modules(stage: Stage, blocks_imported: None) -> None:
    assert stage.reads(CONFIG) == KEYS[stage.name]


def test_config_type_has_the_keys_of_its_base_types() -> None:
    keys = ("walker", "gravity_m_s2", "slope_rad", "push_off", "equations", "contact", "start")
    assert tuple(dotted_keys(SceneConfig)) == keys
    assert tuple(slice_of(CONFIG, SceneConfig)) == keys


def test_slice_contains_only_the_keys_that_a_type_names() -> None:
    assert tuple(dotted_keys(ToleranceConfig)) == ("solver.rigid.rtol", "solver.contact.rtol")
    assert slice_of(CONFIG, ToleranceConfig) == {"solver": {"rigid": {"rtol": 1e-10}, "contact": {"rtol": 1e-7}}}


def test_block_that_a_config_lacks_is_none_in_its_slice() -> None:
    assert slice_of(Config(), ContactConfig)["contact"] is None
    assert restrict(Config(), ContactConfig).contact is None


def test_slice_does_not_depend_on_the_order_of_keys() -> None:
    one, other = slice_of(CONFIG, ToleranceThenStart), slice_of(CONFIG, StartThenTolerance)
    assert list(one) != list(other)
    assert canonical_json(one) == canonical_json(other)


def test_stage_without_a_config_type_gets_the_whole_config() -> None:
    assert slice_of(CONFIG, None) == CONFIG.model_dump(mode="json")
    assert restrict(CONFIG, None) is CONFIG


def test_unknown_key_in_a_slice_raises_an_internal_error() -> None:
    with pytest.raises(KeyError, match="slope_deg"):
        slice_of(CONFIG, MisspeltConfig)
    with pytest.raises(AttributeError, match="slope_deg"):
        restrict(CONFIG, MisspeltConfig)


def test_equal_contents_have_equal_canonical_json() -> None:
    assert canonical_json({"b": 1e-10, "a": [0.1, "θ"]}) == '{"a":[0.1,"\\u03b8"],"b":1e-10}'
    assert json.loads(canonical_json({"x": 0.1 + 0.2}))["x"] == 0.1 + 0.2
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical_json(math.nan)


def test_slice_has_the_same_values_as_the_config() -> None:
    given = restrict(CONFIG, SceneConfig)
    assert given.walker is CONFIG.walker
    assert given.contact is CONFIG.contact
    assert given.slope_rad == 0.0174
    assert restrict(CONFIG, SimulateConfig).solver.rigid is CONFIG.solver.rigid


@pytest.mark.parametrize("key", ["strides", "solver.rigid.atol", "solver.model_dump", "model_dump"])
def test_slice_has_only_the_keys_of_its_type(key: str) -> None:
    given, (*blocks, name) = restrict(CONFIG, StartThenTolerance), key.split(".")
    for block in blocks:
        given = getattr(given, block)
    with pytest.raises(AttributeError, match=name):
        getattr(given, name)


def test_slice_lists_only_the_keys_it_reads_even_if_annotations_are_postponed() -> None:
    module = """
from typing import Protocol

class Pads(Protocol):
    @property
    def terrain(self) -> str: ...

class Own(Protocol):
    @property
    def slope_rad(self) -> float: ...
    @property
    def contact(self) -> Pads: ...
"""
    for first_line in ("", "from __future__ import annotations"):
        names: dict[str, type] = {}
        exec(compile(first_line + module, "own", "exec", dont_inherit=True), names)
        assert tuple(reads.dotted_keys(names["Own"])) == ("slope_rad", "contact.terrain")
