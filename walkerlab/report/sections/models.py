"""How far the two models differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Column, Section, table
from walkerlab.report.numbers import NONE, number, quantity
from walkerlab.report.results import Results

MEASURES = {
    "raw": "at the same time",
    "aligned": "at the same phase of each step",
    "between_impacts": "at the same phase, outside the impacts",
    "settled": "at the same phase, on the last stride",
}
"""The ways in which `compare` takes the difference of the legs' motions."""

ANGLE, VELOCITY, ORBIT = "max_angle_error_rad", "max_velocity_error_rad_s", "orbit_distance"


def section(results: Results) -> Section | None:
    """Largest differences of angles and velocities, and the distance of the orbits."""
    summary = results.summary("compare") or {}
    angle, velocity = summary.get(ANGLE), summary.get(VELOCITY)
    if not angle or not velocity:
        return None
    rows = [[words, printed(angle, key), printed(velocity, key)] for key, words in MEASURES.items() if key in angle]
    columns = [Column("contact model less rigid model"), Column("angle (rad)", True), Column("velocity (rad/s)", True)]
    note = "The larger of both legs. A clock that runs slow makes the difference at the same time grow without bound."
    orbit = summary.get(ORBIT)
    if orbit is not None:
        note += f" Their limit cycles lie at most {quantity(100 * orbit, '%', 2)} of the rigid one’s size apart."
    differences = table("Largest differences of the legs’ motions", columns, rows, note=note)
    found = f"Their legs’ angles differ by at most {printed(angle, 'raw')} rad at the same time"
    if "aligned" in angle:
        found += f", and by {printed(angle, 'aligned')} rad at the same phase of each step"
    return Section("models", "The models compared", (differences,), f"{found}.")


def printed(differences: Mapping[str, Any], key: str) -> str:
    """A largest difference."""
    value = differences.get(key)
    return NONE if value is None else number(float(value), 3)
