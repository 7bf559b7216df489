"""Made-up results of walks in other engines, in the layout that `engines` stores."""

import numpy as np

from walkerlab.evidence.benchmarks.engines import stage as engines
from walkerlab.evidence.benchmarks.engines.experiments import Truth
from walkerlab.evidence.benchmarks.engines.rows import EngineRow, SwingRow, TuningRow
from walkerlab.evidence.benchmarks.engines.stage import EngineFindings
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.contact_result import ContactWalkResult
from walkerlab.physics.hybrid.walk_record import DrivenWork, WalkWork

PERIOD, LENGTH = 0.711, 0.3608


def row(engine, integrator, experiment, step_s, error, wall_s, period_s, steps=10, outcome="walked", start=1.0):
    length = None if period_s is None else LENGTH
    tolerance = 1e-7 if engine == "walkerlab" else None
    touch = 1e-4 if experiment == "same-law" else None
    return EngineRow(
        "compass", engine, "1.0", experiment, integrator, start, step_s, tolerance, error, touch, wall_s,
        period_s, length, None if period_s is None else 1e-3, steps, outcome,
    )  # fmt: skip


ROWS = [
    row("walkerlab", "radau5", "same-law", 2e-3, 8e-4, 0.005, PERIOD, 2),
    row("walkerlab", "radau5", "same-law", 1e-3, 5e-6, 0.006, PERIOD, 2),
    row("mujoco", "RK4", "same-law", 2e-4, 0.3, 0.1, 0.80, 2),
    row("mujoco", "RK4", "same-law", 1e-4, 4e-3, 0.2, PERIOD + 2e-4, 2),
    row("mujoco", "RK4", "same-law", 5e-5, 6e-4, 0.4, PERIOD + 1e-5, 2),
    row("drake", "runge_kutta3", "same-law", 2e-4, 5e-4, 1.0, PERIOD + 1e-5, 2),
    row("drake", "runge_kutta3", "same-law", 1e-4, 5e-6, 2.0, PERIOD + 1e-6, 2),
    row("walkerlab", "impact", "own-law", 2e-3, None, 0.03, PERIOD),
    row("mujoco", "soft", "own-law", 5e-4, None, 0.3, 0.675, 6, "off-pad"),
    row("mujoco", "soft", "own-law", 2.5e-4, 1.6e-3, 0.5, 0.7126),
    row("mujoco", "soft", "own-law", 1.25e-4, 1.5e-3, 1.0, 0.7125),
    row("drake", "lagged", "own-law", 5e-4, 4.9e-3, 2.0, PERIOD + 4.9e-3),
    row("drake", "lagged", "own-law", 2.5e-4, 6e-4, 4.0, PERIOD + 6e-4),
    row("exudyn", "sphere-triangle", "own-law", 2.5e-4, None, 1.0, None, 3, "fell"),
]
SWINGS = [
    SwingRow("compass", "mujoco", "RK4", 4, 8e-3, None, 4.7e-8, 1.3e-9, None, 1e-3),
    SwingRow("compass", "mujoco", "RK4", 4, 4e-3, None, 3.0e-9, 1.6e-11, 3.97, 2e-3),
]
TUNING = [
    TuningRow("compass", "mujoco", "soft", {"friction": 0.7}, "sliding friction", "1", 0.7, 0.67),
    TuningRow("compass", "drake", "lagged", {"friction": 0.7}, "creep velocity", "m/s", 7.4e-3, 7.4e-3),
]


def truth():
    times = np.array((0.7, 0.7 + PERIOD, 0.7 + 2 * PERIOD))
    along = LENGTH * np.arange(1.0, 4.0)
    walk = ContactWalkResult(
        foothold_height_m=None,
        outcome=Outcome.WALKED,
        touch_time_s=times,
        touch_along_m=along,
        slip_m=np.zeros(3),
        rolling_m=np.zeros(3),
        stance_s=np.zeros(3),
        end_time_s=2.2,
        end_state=(0.0,) * 8,
        max_penetration_m=1e-4,
        energy_balance_residual_J=0.0,
        explained_residual_J=0.0,
        dissipated_J=np.zeros(5),
        knee_strike_time_s=None,
        work=WalkWork(0, 0, 0, 0),
        driven=DrivenWork(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        samples=None,
        method="radau5",
    )
    return Truth(2.0, np.zeros(8), times[:2], 2e-12, walk)


def content(rows=ROWS):
    found = EngineFindings(list(rows), list(SWINGS), list(TUNING), [])
    return engines.make_content(found, "compass", truth(), {"period_s": 0.7036, "step_length_m": 0.3714})
