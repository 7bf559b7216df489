"""Systems and methods for states in tuples: what the walker on compliant ground is written in.

A system that registers bodies here is one of `system.py`, too: its states are loaded from arrays and stored in them.
"""

from typing import Any

from walkerlab.kernels import by_type, inlined, vector
from walkerlab.solvers import stepping, system
from walkerlab.solvers.system import State
from walkerlab.solvers.vectors import load, store


@by_type
def blank(system: Any) -> State:
    """A state of zeros: its length is the number of equations, known while compiling."""


@by_type
def derivative(system: Any, t: float, y: State) -> State:
    """dy/dt of `system` at time t (s) and state y."""


@by_type
def jacobian(system: Any, t: float, y: State, J: Any) -> None:
    """Write the derivatives of dy/dt with respect to y into J (n, n)."""


@system.block.default
def whole_state(of: Any) -> State:
    """All of it."""
    return blank(of)


@system.derivative.default
def derivative_in_arrays(of: Any, t: float, y: Any, f: Any) -> None:
    """Loaded and stored."""
    store(derivative(of, t, load(y, 0, blank(of))), f, 0)


@system.jacobian.default
def jacobian_in_arrays(of: Any, t: float, y: Any, J: Any) -> None:
    """Loaded."""
    jacobian(of, t, load(y, 0, blank(of)), J)


@inlined
def begin(method: Any, of: Any, t: float, y: State, h: float) -> None:
    """Start, or start again after an event, from state y at time t (s); h = 0 lets the method choose its first step."""
    store(y, method.y, 0)
    stepping.begin(method, of, t, method.y, h)


@inlined
def interpolate(method: Any, of: Any, fraction: float) -> State:
    """The state at `fraction` (0 to 1) of the last step."""
    y = vector(blank(of))
    stepping.interpolate(method, of, fraction, y)
    return load(y, 0, blank(of))


@inlined
def end_state(method: Any, of: Any) -> State:
    """The state at the end of the last step."""
    return load(method.y, 0, blank(of))
