"""The map behind the adjustment: which scaled starts walk, on the ground and in the rigid model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.recorded_walk import take_walk, with_scaled_rates
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.scaled_starts import ScaledStarts
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.solvers.system import State

Integers = NDArray[np.int64]
RIGID = Tolerances("dop853", 1e-7, 1e-9, ENDLESS)
# columns of a cell
OUTCOME, STEPS, SETTLED, COLUMNS = 0, 1, 2, 3


@dataclass(frozen=True)
class StartMap:
    """Cells over the factors of both velocities; rows are those of the stance leg."""

    swing: NDArray[np.float64]  # (columns,) factors on the swing leg's velocity
    stance: NDArray[np.float64]  # (rows,) factors on the stance leg's velocity
    outcome: Integers  # (rows, columns)
    steps: Integers  # (rows, columns)
    settled: Integers  # (rows, columns) 1 if the last step is the gait's

    @property
    def walking(self) -> NDArray[np.float64]:
        """(n, 2) factors of the cells that walk and settle."""
        rows, columns = np.nonzero((self.outcome == Outcome.WALKED) & (self.settled == 1))
        return np.column_stack((self.swing[columns], self.stance[rows]))

    def share(self) -> float:
        """Part of the cells that walk and settle."""
        return float(self.walking.shape[0]) / self.outcome.size


def contact_row(starts: ScaledStarts, swing: NDArray[np.float64], stance: float) -> Integers:
    """(columns, 3) outcome, steps and whether settled of one row of cells."""
    trials = [starts.walk(float(factor), float(stance)) for factor in swing]
    return np.array([(trial.outcome, trial.steps, trial.settled) for trial in trials], np.int64)


def rigid_map(
    walker: Standing, state: State, swing: NDArray[np.float64], stance: NDArray[np.float64], steps: int
) -> StartMap:
    """The same starts in the rigid model, whose ground may also pull: then the outcome is `lifted-off`."""
    rows = []
    for factor_2 in stance:
        row = []
        for factor_1 in swing:
            start = with_scaled_rates(walker, state, float(factor_1), float(factor_2))
            walk = take_walk(walker, RIGID, start, steps)
            row.append((int(walk.outcome), walk.steps, walk.steps == steps))
        rows.append(np.array(row, np.int64))
    return as_map(swing, stance, rows)


def as_map(swing: NDArray[np.float64], stance: NDArray[np.float64], rows: list[Integers]) -> StartMap:
    """The map of its rows (columns, 3)."""
    cells = np.stack(rows)
    return StartMap(swing, stance, cells[:, :, OUTCOME], cells[:, :, STEPS], cells[:, :, SETTLED])
