"""Parameter errors to expect from a walk before it is measured, computed from the derivatives of a predicted walk."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.estimation.fit import FitProblem, linearise
from walkerlab.physics.estimation.information import information_from
from walkerlab.physics.estimation.measurements import MeasuredAngles
from walkerlab.physics.estimation.mixed_model import Linearised, Noise, evaluate, products_of
from walkerlab.physics.estimation.prediction import Forecast
from walkerlab.physics.estimation.result import Information
from walkerlab.physics.solvers.system import Floats


@dataclass(frozen=True, eq=False)
class PlannedWalk:
    """Predicted walk that has not been measured, with its derivatives."""

    data: Linearised
    quantities: tuple[str, ...]  # quantities that could be measured
    step: NDArray[np.int64]  # (values,) index of each value's step
    keys: tuple[str, ...]
    scales: Floats

    def expect(
        self, steps: int, measured: Collection[str], noise: Mapping[str, float], roughness_m: float
    ) -> Information:
        """Return the information about the parameters in the `measured` quantities of the first `steps` steps."""
        deviations = np.array([noise[name] for name in self.quantities])
        used = np.isin(self.data.quantity, [self.quantities.index(name) for name in measured])
        rows = used & (self.step < steps)
        data = replace(
            self.data, residuals=self.data.residuals[rows], J=self.data.J[rows], G=self.data.G[rows],
            quantity=self.data.quantity[rows],
        )  # fmt: skip
        whole = evaluate(products_of(data), Noise(deviations, roughness_m)).information
        return information_from(whole, self.keys, self.scales, int(np.count_nonzero(rows)))


def planned_walk(problem: FitProblem, keys: tuple[str, ...]) -> PlannedWalk | None:
    """Predict the walk from the problem's start, with derivatives; None if it, or a slightly changed walk, fails."""
    forecast = problem.forecast
    u = np.zeros(forecast.unknowns)
    u[: forecast.scales.size] = np.array(problem.start) / forecast.scales
    data = linearise(problem, u, np.zeros(forecast.heights), exact=True)
    return None if data is None else PlannedWalk(data, forecast.quantities, steps_of(forecast), keys, forecast.scales)


def steps_of(forecast: Forecast) -> NDArray[np.int64]:
    """Return the index (values,) of the step that each value belongs to."""
    steps = np.tile(np.arange(forecast.steps.count), len(forecast.channels))
    measured = forecast.measured
    return np.append(steps, np.repeat(measured.step, 2)) if isinstance(measured, MeasuredAngles) else steps
