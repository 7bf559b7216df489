"""Check that each stage that takes a key accepts every parameter of every built-in walker, or explains why not."""

from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.analyses import Design
from walkerlab.config.fields import describe_type, leaves
from walkerlab.config.files import builtin_names
from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.physics.orbits.families import ValueSpan
from walkerlab.physics.orbits.family_search import CONTACT, RIGID
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.stages import robustness
from walkerlab.pipeline.stages.continuation import FamilyQuestion, models_of
from walkerlab.pipeline.stages.design import Gaits
from walkerlab.pipeline.sweeps.question import axis, described
from walkerlab.scene.parameter import MODEL_KEYS, parameter_of

WALKERS = {
    # Most requests are refused for walkers whose legs differ.
    **dict.fromkeys(sorted({*builtin_names()} - {"one-knee", "prosthesis"}), ()),
    "kneed with compliant stops": ("walker.knee.lock=compliant",),
    "paper with a hip": ("walker.hip={spring_N_m_per_rad: 1, damping_N_m_s_per_rad: 0.1, torque_N_m: 0.01}",),
}
ONLY_CONTACT = ("contact.", "push_off.duration_s", "walker.knee.stop_")
PULSED = ("level", "kneed-level")
RIGID_ONLY = ("kuo", "rigid-only", "simplest")
IDEAL_KNEES = ("kneed", "kneed-level", "kneed-round-feet", "parts")
REFUSED = (
    ("continuation", sorted({*WALKERS} - {*PULSED}), "push_off.duration_s", "does not affect the rigid"),
    ("continuation", RIGID_ONLY, "walker.foot_radius_m", "does not affect the rigid model"),
    ("continuation", IDEAL_KNEES, "walker.knee.stop_*", "does not affect the rigid or the contact model"),
    ("second", WALKERS, "contact.*", "does not affect the rigid model"),
    ("second", WALKERS, "push_off.duration_s", "does not affect the rigid model"),
    ("second", WALKERS, "walker.foot_radius_m", "does not affect the rigid model"),
    ("second", WALKERS, "walker.knee.stop_*", "does not affect the rigid model"),
    ("second", WALKERS, "gravity_m_s2", "is already the parameter that gaits are followed over"),
    ("*", ("paper-as-printed",), "walker.hip.*", "cannot be 1e-15"),
    ("*", ("paper-as-printed",), "push_off.impulse_N_s", "cannot be 1e-15"),
    ("*", ("parts",), "walker.leg_length_m", "cannot be 0.999 m"),
    ("gradients", ("kuo", "simplest"), "walker.leg_inertia_kg_m2", ""),
    ("gradients", ("kuo",), "walker.hip.[dt]*", ""),
    ("gradients", ("simplest",), "walker.hip.*", ""),
)
"""Refusals that are expected: the kind of request, the walkers, the keys, and words of the message, if any."""


def may_be_refused(question, walker, key, said=""):
    """Whether a refusal is one of the expected ones."""
    return any(
        fnmatch(question, asked) and walker in walkers and fnmatch(key, keys) and (words in said or not said)
        for asked, walkers, keys, words in REFUSED
    )


@pytest.fixture(scope="module", params=WALKERS)
def walker(request):
    return request.param


@pytest.fixture(scope="module")
def config(walker):
    return load(Path(walker.split(" ")[0]), WALKERS[walker]).config


@pytest.fixture(scope="module")
def keys(config):
    """Return the keys of a model whose values in the config are numbers."""
    found = ["slope_deg"]
    for path, field in leaves(Config, held=config):
        held = config
        for name in path:
            held = getattr(held, name, None)
        if path[0] in MODEL_KEYS and "number" in describe_type(field.annotation) and isinstance(held, int | float):
            found.append(".".join(path))
    return found


def question(config, key, model):
    """Return a request for `continuation` over a small span above the value of the key, or below it if the value is at
    the upper bound.
    """
    taken = restrict(config, PIPELINE["continuation"].takes)
    taken.continuation = config.continuation.model_copy(update={"model": model})
    parameter = parameter_of(key, taken)
    value = parameter.value_in(taken)
    ends = (value, 1.001 * value) if value else (0.0, 1e-15)
    if value and parameter.config_at(taken, ends[1]) is None:
        ends = (0.999 * value, value)
    return FamilyQuestion(taken, parameter, ValueSpan(*ends))


def followed(asked):
    """Return the models whose gaits were followed, or the reason why there are none."""
    try:
        return models_of(asked), ""
    except ConfigError as error:
        return (), error.message


def test_continuation_accepts_every_parameter_or_explains_why_not(walker, config, keys):
    every = (RIGID,) if config.contact is None else (RIGID, CONTACT)
    for key in keys:
        models, refused = followed(question(config, key, "rigid" if len(every) == 1 else "both"))
        assert models in (every, (CONTACT,)) or f" {key} " in f" {refused} "
        assert models or may_be_refused("continuation", walker, key, refused), f"{key}: {refused}"
        assert RIGID in models or refused or key.startswith((*ONLY_CONTACT, "walker.foot_radius_m"))


def test_second_continuation_parameter_is_rejected_only_for_an_expected_reason(walker, config, keys):
    first = question(config, "gravity_m_s2", "rigid")
    for key in keys:
        span = question(config, key, "rigid").span
        second = {"over": key, "from": span.least, "to": span.most}
        block = Config.model_validate({"continuation": {"model": "rigid", "second": second}}).continuation
        taken = restrict(config, PIPELINE["continuation"].takes)
        taken.continuation = block
        models, refused = followed(replace(first, config=taken))
        assert models == (RIGID,) or refused.startswith("continuation.second")
        assert models or f" {key} " in f" {refused} "
        assert models or may_be_refused("second", walker, key, refused), f"{key}: {refused}"


@pytest.fixture(scope="module")
def fixedpoint(config):
    return answer_in_memory(config, "fixedpoint", MemoryResults())


@pytest.fixture(scope="module")
def subject(config, fixedpoint):
    """Return the gait of the rigid model in the form that disturbances are applied to."""
    taken = restrict(config, PIPELINE["robustness"].takes)
    return next(robustness.subjects(taken, {"fixedpoint": fixedpoint}, Silent()))


def test_design_has_gait_and_gradient_for_every_parameter(walker, config, keys, fixedpoint, subject):
    taken = restrict(config, PIPELINE["design"].takes)
    for key in keys:
        parameter, asked = parameter_of(key, taken), Design(minimise="period_s", over={key: [0.0, 1.0]})
        own = np.array([parameter.value_in(taken)])
        found = Gaits(taken, asked, fixedpoint.summary, Silent()).gait_at(own)
        if found is None:
            assert not robustness.gradients_of(subject, key), "the walker has no other value of it"
            assert may_be_refused("gradients", walker, key), key
            continue
        assert found.numbers["period_s"] == pytest.approx(fixedpoint.summary["period_s"], abs=1e-9)
        assert np.all(np.isfinite(found.gradients["period_s"])), key


ALL_BUT_THE_RIGID_MODEL = {"name", "source", "strides", "ground", "contact", "recording", "outputs"}


@pytest.fixture(scope="module")
def known():
    """Return an empty cache of gradients, by the keys that the rigid model reads and by parameter."""
    return {}


def gradients_by(key, config, subject, known):
    """Return the gradients. Walkers of equal rigid model share them, unless the key is in a block that may differ."""
    same = config.model_dump_json(exclude=ALL_BUT_THE_RIGID_MODEL), key
    if same not in known or key.startswith(ONLY_CONTACT):
        known[same] = robustness.gradients_of(subject, key)
    return known[same]


def test_robustness_has_derivatives_for_every_parameter(walker, config, keys, subject, known):
    read = set(robustness.parameters_read(subject))
    assert read <= set(keys)
    assert not any(key.startswith(ONLY_CONTACT) for key in read)
    for key in keys:
        gradients = gradients_by(key, config, subject, known)
        assert gradients or may_be_refused("gradients", walker, key), key
        for name, gradient in gradients.items():
            assert gradient.value is not None or gradient.why, f"{name} by {key}"
            assert gradient.value is None or np.isfinite(gradient.value), f"{name} by {key}"
            if key.startswith(ONLY_CONTACT):
                assert gradient.value is not None, f"{name} by {key}: {gradient.why}"
                effect = gradient.value * parameter_of(key, config).value_in(config)
                assert abs(effect) < 1e-6, f"the rigid model does not read {key}"


def test_sweeps_accept_every_parameter(config, keys):
    for key in keys:
        asked = question(config, key, "rigid")
        ends = (asked.span.least, asked.span.most)
        assert axis(key, f"{ends[0]!r}:{ends[1]!r}:2", f"--over {key}").values == pytest.approx(ends)
        assert described(config, key)[1] != key, "its meaning is known"
