"""Run identity: a changed config runs beside the unchanged one, in a folder that is named after the change."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walkerlab.config.loader import load
from walkerlab.config.numbers import short


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
    ],
)
def test_the_change_is_readable(sets: list[str], name: str) -> None:
    assert name_of(*sets) == name


def test_what_changes_nothing_runs_in_the_configs_own_folder() -> None:
    assert name_of("slope_rad=0.0174", "strides=5", "contact.stiffness=100000") == "paper"
    assert name_of(strides=5) == "paper"


def test_one_experiment_has_one_folder_however_it_was_typed() -> None:
    assert name_of("strides=3") == name_of(strides=3) == name_of("strides=8", "strides=3")
    assert name_of("contact.stiffness=1e6", "strides=3") == name_of("strides=3", "contact.stiffness=1.0e+6")


def test_bringing_in_a_block_is_a_change_even_with_all_its_defaults() -> None:
    rigid = Path("rigid-only")
    assert name_of("contact={}", path=rigid) == "rigid-only@contact=added"
    assert name_of("contact.damping=5", path=rigid) == "rigid-only@contact=added,contact.damping=5"


def test_long_changes_are_shortened_and_stay_apart() -> None:
    first, second = (
        name_of(
            "start=[0, 0.1674123456789, -0.612345678901, -0.84]",
            f"gravity_m_s2=1.62345{last}",
            "walker.hip_mass_kg=7.5",
        )
        for last in "12"
    )
    assert first != second
    assert len(first) < 100


@settings(deadline=None)
@given(
    slope=st.floats(-89.0, 89.0),
    stiffness=st.floats(1.0, 1e14),
    strides=st.integers(1, 10_000),
    start=st.tuples(st.floats(-0.5, 0.5), st.floats(-1e3, 1e3)),
)
def test_a_run_name_is_one_safe_path_component(
    slope: float, stiffness: float, strides: int, start: tuple[float, float]
) -> None:
    name = name_of(
        f"slope_deg={slope!r}",
        f"contact.stiffness={stiffness!r}",
        f"start=[0.0, {start[0]!r}, {start[1]!r}, 0.0]",
        strides=strides,
    )
    assert re.fullmatch(r"paper(@[A-Za-z0-9._,=-]+)?", name)
    assert len(name) < 160


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_short_number_reads_back_as_itself(number: float) -> None:
    assert float(short(number)) == number
    assert len(short(number)) <= len(repr(number))
    assert "+" not in short(number)


@settings(deadline=None)
@given(st.floats(-89.0, 89.0), st.floats(-89.0, 89.0))
def test_different_slopes_never_share_a_folder(one: float, other: float) -> None:
    first, second = load(None, [f"slope_deg={one!r}"]), load(None, [f"slope_deg={other!r}"])
    assert first.run_name != second.run_name or first.config == second.config
