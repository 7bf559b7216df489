"""Tests of the request for a sweep: its points, stages and keys."""

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep, described, distinct_ends, refuse_unrecorded


def question(*over, **options):
    return build_sweep("fixedpoint", [axis_of_text(text) for text in over], **options)


def test_range_includes_both_ends():
    grid = question("slope_deg=0.5:5:50", "contact.static_friction=[0.3,0.6,0.9]")
    slopes, frictions = grid.axes
    assert slopes.values == tuple(np.linspace(0.5, 5.0, 50).tolist())
    assert frictions.values == (0.3, 0.6, 0.9)
    assert grid.names == grid.dims == ("slope_deg", "static_friction")
    assert grid.shape == (50, 3)
    assert len(grid) == 150
    assert grid.places(4) == (1, 1)


def test_values_to_sweep_may_be_options_or_logarithmically_spaced():
    assert question("contact.terrain=[checkerboard, after-mid-swing]").axes[0].values[1] == "after-mid-swing"
    assert question("contact.stiffness=1e4:1e6:3:log").axes[0].values == pytest.approx((1e4, 1e5, 1e6), rel=1e-14)


def test_range_over_an_integer_key_has_integers():
    assert question("strides=2:4:3").axes[0].values == (2, 3, 4)
    assert all(isinstance(value, int) for value in question("strides=2:4:3").axes[0].values)
    assert question("slope_deg=2:4:3").axes[0].values == (2.0, 3.0, 4.0)


@pytest.mark.parametrize("option", ["--show", "--against"])
def test_unknown_quantity_is_rejected_before_anything_is_computed(option):
    slopes = question("slope_deg=1:3:3")
    for name in ("froude", "slope_deg", "work_per_step_J.hip_torque", "gaits.1.period_s"):
        refuse_unrecorded(slopes, {f"{option} {name}": name})
    with pytest.raises(ConfigError, match=rf"{option} froud: fixedpoint has no such quantity.*mean froude"):
        refuse_unrecorded(slopes, {f"{option} froud": "froud"})


def test_zip_option_pairs_values():
    pairs = question("slope_deg=1:3:3", "walker.hip_mass_kg=[5, 10, 15]", zipped=True)
    assert [pairs.places(index) for index in range(len(pairs))] == [(0, 0), (1, 1), (2, 2)]
    assert pairs.dims == ("point",)
    with pytest.raises(ConfigError, match=r"different numbers of values: slope_deg 3, walker\.hip_mass_kg 2"):
        question("slope_deg=1:3:3", "walker.hip_mass_kg=[5, 10]", zipped=True)


@pytest.mark.parametrize("sampler", ["latin-hypercube", "sobol", "random"])
def test_sample_is_within_its_intervals_and_determined_by_its_seed(sampler):
    over = ("slope_deg=0.5:5", "contact.static_friction=[0.3, 0.6]")
    drawn = question(*over, sample=f"{sampler}:16", seed=3)
    slopes, frictions = (np.array(axis.values) for axis in drawn.axes)
    assert len(drawn) == 16
    assert slopes.min() >= 0.5
    assert slopes.max() <= 5.0
    assert set(frictions) == {0.3, 0.6}
    assert question(*over, sample=f"{sampler}:16", seed=3).axes == drawn.axes
    assert question(*over, sample=f"{sampler}:16", seed=4).axes != drawn.axes


def test_latin_hypercube_has_one_point_in_each_layer():
    slopes = np.array(question("slope_deg=0:8", "walker.hip_mass_kg=1:9", sample="latin-hypercube:8").axes[0].values)
    assert sorted(np.floor(slopes)) == list(range(8))


def test_parameters_have_short_names_unless_ambiguous():
    assert distinct_ends(["solver.rigid.rtol", "solver.contact.rtol", "slope_deg"]) == (
        "rigid.rtol",
        "contact.rtol",
        "slope_deg",
    )


def test_sweep_without_parameters_shows_an_example():
    with pytest.raises(ConfigError) as refused:
        question()
    assert "`walkerlab sweep --over slope_deg=" in refused.value.advice


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ("slope_dge=1:2:3", "did you mean slope_deg"),
        ("slope_deg", "not of the form KEY=VALUES"),
        ("slope_deg=1:2", "number of values is missing"),
        ("slope_deg=a:b:c", "not a range of values"),
        ("slope_deg=1:2:0", "not a range of values"),
        ("slope_deg=1:2:3:lin", "not a range of values"),
        ("slope_deg=0:2:3:log", "above 0"),
        ("slope_deg=[]", "an empty list"),
        ("slope_deg=[[1]]", "FROM:TO:N"),
        ("contact=[1]", "a block of keys"),
    ],
)
def test_invalid_sweeps_are_rejected_with_the_allowed_values(over, said):
    with pytest.raises(ConfigError, match=said):
        question(over)


def test_missing_or_repeated_parameters_and_unknown_samplers_are_rejected():
    with pytest.raises(ConfigError, match="no parameter"):
        question()
    with pytest.raises(ConfigError, match="given twice"):
        question("slope_deg=1:2:3", "slope_deg=[1]")
    with pytest.raises(ConfigError, match="latin-hypercube:N"):
        question("slope_deg=1:2", sample="dice:3")


def test_parameter_has_the_unit_of_its_key():
    assert described(load().config, "walker.hip_mass_kg") == ("kg", "M_H, mass at the hip")
    assert described(load().config, "contact.stiffness")[0] == "N/mm^e"
    in_si = load(sets=["contact={units: si}"]).config
    assert described(in_si, "contact.stiffness")[0] == "N/m^e"


@pytest.mark.parametrize(
    ("over", "options"),
    [
        (["slope_deg=0.5:3:1000000000"], {}),
        (["slope_deg=0.5:3:1000000000"], {"zipped": True}),
        (["slope_deg=0.5:3:1000000000"], {"sample": "random:10"}),
        (["slope_deg=0.5:3:5000", "strides=1:5000:5000"], {}),
        (["slope_deg=0.5:3"], {"sample": "sobol:1000000000"}),
    ],
)
def test_too_many_points_are_rejected_before_they_are_built(over, options):
    with pytest.raises(ConfigError, match=r"0 points; allowed: up to 10000000 in one sweep"):
        question(*over, **options)
