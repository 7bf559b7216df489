"""What a continuous system is to an integrator: functions whose bodies are chosen by the type of the system.

A system is a NamedTuple that registers a body for each of these; an integrator calls nothing else. States go in and
come out as tuples of floats, so that compiled code keeps them in registers.
"""

from typing import Any

from walkerlab.kernels import by_type

State = tuple[float, ...]


@by_type
def blank(system: Any) -> State:
    """A state of zeros: its length is the number of equations, known while compiling."""


@by_type
def derivative(system: Any, t: float, y: State) -> State:
    """dy/dt of `system` at time t (s) and state y."""


@by_type
def jacobian(system: Any, t: float, y: State, J: Any) -> None:
    """Write the derivatives of dy/dt with respect to y into J (n, n); implicit methods need it."""
