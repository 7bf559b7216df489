"""Linear systems of implicit methods, (s I - J) x = r, reduced to half their size for equations of motion.

With q' = v the upper half of the Jacobian is (0 I). Eliminating the positions leaves
(s I - J_v - J_q / s) x_v = r_v + J_q r_q / s and x_q = (r_q + x_v) / s. The factors take an eighth of the work.
If the velocities were eliminated instead, x_v = s x_q - r_q would cancel digits where damping is stiff.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8, special structure.
"""

from typing import Any

from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.solvers.linear import factor, reciprocal, solve


@kernel_part
def unknowns(J: Any) -> int:
    """Count the unknowns of the reduced system for a Jacobian J (n, n): n/2 for equations of motion, otherwise n."""
    n = J.shape[0]
    half = n // 2
    if 2 * half != n:
        return n
    for i in range(half):
        for j in range(n):
            # Compared exactly: the Jacobian of equations of motion has these rows as literal zeros and ones.
            if J[i, j] != (1.0 if j == half + i else 0.0):
                return n
    return half


@kernel_part
def factor_shifted(J: Any, size: int, s: Any, factors: Any, pivots: Any) -> bool:
    """Factor the reduced matrix for shift s into `factors` (size, size), real or complex, or return False if it is
    singular.
    """
    n = J.shape[0]
    inverse = reciprocal(s)
    for i in range(size):
        for j in range(size):
            factors[i, j] = -J[i, j] if size == n else -J[size + i, size + j] - inverse * J[size + i, j]
        factors[i, i] += s
    return factor(factors, pivots, size)


@kernel_part
def solve_shifted(J: Any, size: int, s: Any, factors: Any, pivots: Any, r: Any) -> None:
    """Solve with factors from `factor_shifted`, overwriting r (n,)."""
    if size == J.shape[0]:
        solve(factors, pivots, r, 0, size)
        return
    inverse = reciprocal(s)
    for i in range(size):
        r[i] *= inverse
    for i in range(size):
        total = r[size + i]
        for j in range(size):
            total += J[size + i, j] * r[j]
        r[size + i] = total
    solve(factors, pivots, r, size, size)
    for i in range(size):
        r[i] += inverse * r[size + i]
