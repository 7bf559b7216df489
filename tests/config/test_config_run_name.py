"""Check that the results of a changed config go to a folder named after the change."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walkerlab.config.fields import short_number
from walkerlab.config.loader import load


def name_of(*sets: str, path: Path | None = None, strides: int | None = None) -> str:
    return load(path, sets, strides).run_name


@pytest.mark.parametrize(
    ("sets", "name"),
    [
        ([], "paper"),
        (["slope_deg=3"], "paper@slope_deg=3"),
        (["slope_rad=0.05"], "paper@slope_rad=0.05"),
        (["contact.stiffness=1e6"], "paper@contact.stiffness=1e6"),
        (["contact=null"], "paper@contact=none"),
        (["outputs=[]"], "paper@outputs=none"),
        (["outputs=[forces, states]"], "paper@outputs=states_forces"),
        (["start=[-0.2022, 0.1674, -1.02, -3.2]"], "paper@start=-0.2022_0.1674_-1.02_-3.2"),
        (["name=other"], "other"),
        (["name=other", "strides=9"], "other@strides=9"),
        (["strides=9", "slope_deg=3"], "paper@slope_deg=3,strides=9"),
        (["walker.leg_2.leg_mass_kg=5.5"], "paper@walker.leg_2.leg_mass_kg=5.5"),
    ],
)
def test_run_name_shows_the_change(sets: list[str], name: str) -> None:
    assert name_of(*sets) == name


def test_setting_without_effect_keeps_the_run_name() -> None:
    assert name_of("slope_rad=0.0174", "strides=5", "contact.stiffness=100000") == "paper"
    assert name_of(strides=5) == "paper"


def test_equivalent_settings_share_a_run_name() -> None:
    assert name_of("strides=3") == name_of(strides=3) == name_of("strides=8", "strides=3")
    assert name_of("contact.stiffness=1e6", "strides=3") == name_of("strides=3", "contact.stiffness=1.0e+6")


def test_adding_a_block_of_defaults_changes_the_run_name() -> None:
    rigid = Path("rigid-only")
    assert name_of("contact={}", path=rigid) == "rigid-only@contact=added"
    assert load(rigid, ["contact.damping=5"]).changes == ("contact=added", "contact.damping=5")


def test_long_run_name_is_its_first_key_and_a_digest() -> None:
    longest = "paper@walker.leg_mass_kg=6.25,strides=90"
    assert name_of("walker.leg_mass_kg=6.25", "strides=90") == longest
    assert len(longest) == 40
    assert re.fullmatch(r"paper@walker\.leg_mass_kg-[0-9a-f]{8}", name_of("walker.leg_mass_kg=6.25", "strides=900"))
    first, second = (name_of(f"walker.leg_mass_kg={mass}", "walker.hip_mass_kg=12.5") for mass in (6.25, 6.5))
    assert re.fullmatch(r"paper@walker\.leg_mass_kg-[0-9a-f]{8}", first)
    assert first != second


def test_long_run_name_still_names_the_changed_stage() -> None:
    asked = ("design.maximise=speed_m_s", "design.over={slope_deg: [1, 3]}")
    assert re.fullmatch(r"paper@design-[0-9a-f]{8}", name_of("gravity_m_s2=1.62", *asked))


def test_every_change_is_listed_even_if_the_name_is_short() -> None:
    changed = load(None, ["walker.hip_mass_kg=12.5", "slope_deg=3"], strides=9)
    assert changed.changes == ("walker.hip_mass_kg=12.5", "slope_deg=3", "strides=9")
    assert load().changes == ()


def test_invalid_characters_are_removed_from_run_names() -> None:
    assert re.fullmatch(r"paper@sweep-[0-9a-f]{8}", name_of("sweep={sample: a/b}"))


@settings(deadline=None)
@given(
    slope=st.floats(-89.0, 89.0),
    stiffness=st.floats(1.0, 1e14),
    strides=st.integers(1, 10_000),
    start=st.tuples(st.floats(-0.5, 0.5), st.floats(-1e3, 1e3)),
)
def test_run_name_is_a_safe_path_component(
    slope: float, stiffness: float, strides: int, start: tuple[float, float]
) -> None:
    name = name_of(
        f"slope_deg={slope!r}",
        f"contact.stiffness={stiffness!r}",
        f"start=[null, {start[0]!r}, {start[1]!r}, 0.0]",
        strides=strides,
    )
    assert re.fullmatch(r"paper(@[A-Za-z0-9._,=-]+)?", name)
    assert len(name) <= 40


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_shortened_number_reads_back_unchanged(number: float) -> None:
    assert float(short_number(number)) == number
    assert len(short_number(number)) <= len(repr(number))
    assert "+" not in short_number(number)


@settings(deadline=None)
@given(st.floats(-89.0, 89.0), st.floats(-89.0, 89.0))
def test_different_slopes_have_different_run_names(one: float, other: float) -> None:
    first, second = load(None, [f"slope_deg={one!r}"]), load(None, [f"slope_deg={other!r}"])
    assert first.run_name != second.run_name or first.config == second.config
