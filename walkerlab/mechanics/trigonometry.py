"""Sine and cosine together, for the small angles of legs."""

import math

from walkerlab.kernels import inlined
from walkerlab.mechanics.fused import fused

QUARTER_PI = 0.7853981633974483


@inlined
def sine_cosine(x: float) -> tuple[float, float]:
    """(sin x, cos x) within one unit in the last place.

    Up to pi/4, where a walking leg stays, both are the minimax polynomials of fdlibm (k_sin.c, k_cos.c; Sun
    Microsystems 1993), evaluated side by side, each in pairs of terms that do not wait for each other; beyond, the
    library's.
    """
    if abs(x) > QUARTER_PI:
        return math.sin(x), math.cos(x)
    z = x * x
    w = z * z
    s1 = fused(z, 8.33333333332248946124e-03, -1.66666666666666324348e-01)
    s3 = fused(z, 2.75573137070700676789e-06, -1.98412698298579493134e-04)
    s5 = fused(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08)
    sine = fused(x * z, fused(w, fused(w, s5, s3), s1), x)
    c1 = fused(z, -1.38888888888741095749e-03, 4.16666666666666019037e-02)
    c3 = fused(z, -2.75573143513906633035e-07, 2.48015872894767294178e-05)
    c5 = fused(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09)
    half = 0.5 * z
    leading = 1.0 - half
    return sine, leading + fused(w, fused(w, fused(w, c5, c3), c1), (1.0 - leading) - half)
