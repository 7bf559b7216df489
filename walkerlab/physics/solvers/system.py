"""Interface of continuous systems: functions whose bodies are chosen by the type of the system.

A system is a NamedTuple that registers a body for each of these functions. Integrators call nothing else. States are
arrays (n,) in the caller's memory, which `derivative` and `jacobian` never write.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.kernels import dispatch_by_type

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
State = tuple[float, ...]
"""Immutable state, outside compiled code."""


@dispatch_by_type
def block(system: Any) -> Any:
    """Return a value whose length is the block size of loops over the state.

    The length is fixed at compile time and divides n.
    """


@dispatch_by_type
def derivative(system: Any, t: float, y: Any, f: Any) -> None:
    """Write dy/dt of `system` at time t (s) and state y (n,) into f (n,)."""


@dispatch_by_type
def jacobian(system: Any, t: float, y: Any, J: Any) -> None:
    """Write the derivatives of dy/dt with respect to y into J (n, n). Implicit methods need it."""
