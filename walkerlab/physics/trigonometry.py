"""Sine and cosine together, for the small angles of legs."""

import math

from walkerlab.kernels import inlined

QUARTER_PI = 0.7853981633974483


@inlined
def sine_cosine(x: float) -> tuple[float, float]:
    """(sin x, cos x) within one unit in the last place.

    Up to pi/4, where a walking leg stays, both are the minimax polynomials of fdlibm (k_sin.c, k_cos.c; Sun
    Microsystems 1993), evaluated side by side; beyond, the library's.
    """
    if abs(x) > QUARTER_PI:
        return math.sin(x), math.cos(x)
    z = x * x
    tail = 8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04
        + z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))
    )
    sine = x + x * z * (-1.66666666666666324348e-01 + z * tail)
    r = z * (
        4.16666666666666019037e-02
        + z
        * (
            -1.38888888888741095749e-03
            + z
            * (
                2.48015872894767294178e-05
                + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))
            )
        )
    )
    half = 0.5 * z
    leading = 1.0 - half
    return sine, leading + (((1.0 - leading) - half) + z * r)
