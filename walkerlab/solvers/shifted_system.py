"""The linear systems of implicit methods, (s I - J) x = r, in half their size for equations of motion.

With q' = v the upper half of the Jacobian is (0 I). Eliminating the positions leaves
(s I - J_v - J_q / s) x_v = r_v + J_q r_q / s and x_q = (r_q + x_v) / s: an eighth of the work for the factors.
The other way round x_v = s x_q - r_q would cancel where damping is stiff.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8, special structure.
"""

from typing import Any

from walkerlab.kernels import inlined
from walkerlab.solvers.linear import factor, reciprocal, solve


@inlined
def unknowns(J: Any) -> int:
    """Unknowns that are left of a system with Jacobian J (n, n): n/2 for equations of motion, else n."""
    n = J.shape[0]
    half = n // 2
    if 2 * half != n:
        return n
    for i in range(half):
        for j in range(n):
            if J[i, j] != (1.0 if j == half + i else 0.0):
                return n
    return half


@inlined
def factor_shifted(J: Any, left: int, s: Any, factors: Any, pivots: Any) -> bool:
    """Factors (left, left) for the shift s, real or complex as `factors` is; False if the matrix is singular."""
    n, wait = J.shape[0], reciprocal(s)
    for i in range(left):
        for j in range(left):
            factors[i, j] = -J[i, j] if left == n else -J[left + i, left + j] - wait * J[left + i, j]
        factors[i, i] += s
    return factor(factors, pivots, left)


@inlined
def solve_shifted(J: Any, left: int, s: Any, factors: Any, pivots: Any, r: Any) -> None:
    """Overwrite r (n,) with the solution."""
    if left == J.shape[0]:
        solve(factors, pivots, r, 0, left)
        return
    wait = reciprocal(s)
    for i in range(left):
        r[i] *= wait
    for i in range(left):
        total = r[left + i]
        for j in range(left):
            total += J[left + i, j] * r[j]
        r[left + i] = total
    solve(factors, pivots, r, left, left)
    for i in range(left):
        r[i] += wait * r[left + i]
