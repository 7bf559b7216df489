"""What a continuous system is to an integrator: functions whose bodies are chosen by the type of the system.

A system is a NamedTuple. It registers a body for each of these; an integrator calls nothing else.
"""

from typing import Any

from walkerlab.kernels import by_type


@by_type
def derivative(system: Any, t: float, y: Any, dy: Any) -> None:
    """Write dy/dt of `system` at time t (s) and state y (n,) into dy (n,)."""


@by_type
def jacobian(system: Any, t: float, y: Any, J: Any) -> None:
    """Write the derivatives of dy/dt with respect to y into J (n, n); implicit methods need it."""
