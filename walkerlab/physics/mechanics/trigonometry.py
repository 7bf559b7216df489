"""Sine and cosine computed together, fastest for the small angles of walking legs."""

import math

from walkerlab.physics.kernels import PART_FLAGS, compile_as, kernel_part
from walkerlab.physics.solvers.lanes import Lanes, any_positive, fused, holds_lanes, nearest

QUARTER_PI = 0.7853981633974483
PER_PI = 0.3183098861837907
HALF_PI = 1.5707963267948966
# pi as a sum of two parts. The first has 33 bits, so its products with integers of up to 20 bits are exact.
PI_1 = 3.1415926534682512
PI_2 = 1.2154201012607932e-10


def sine_cosine(x: float) -> tuple[float, float]:
    """Compute (sin x, cos x) within one unit in the last place.

    Up to pi/4, the range of a walking leg, this evaluates the minimax polynomials of fdlibm (k_sin.c, k_cos.c; Sun
    Microsystems 1993) in independent pairs of terms. For larger angles it calls the library's functions.
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
    # (1 - leading) - half is the rounding error of `leading`, which is added back, as in k_cos.c.
    leading = 1.0 - half
    return sine, leading + fused(w, fused(w, fused(w, c5, c3), c1), (1.0 - leading) - half)


def lanes_sine_cosine(x: Lanes) -> tuple[Lanes, Lanes]:
    """Compute (sin x, cos x) for each lane, with errors below 3e-16 for angles up to a few thousand turns."""
    # If any lane is further than a quarter turn from 0, the nearest multiple k pi is subtracted in every lane. Odd k
    # flips the sign, and k = 0 leaves a lane unchanged.
    if any_positive(abs(x) - HALF_PI):
        k = nearest(PER_PI * x)
        odd = k - 2.0 * nearest(0.5 * k)
        sign = 1.0 - 2.0 * odd * odd
        sine, cosine = half_turn(fused(-k, PI_2, fused(-k, PI_1, x)))
        return sign * sine, sign * cosine
    return half_turn(x)


@kernel_part
def half_turn(x: Lanes) -> tuple[Lanes, Lanes]:
    """Compute (sin x, cos x) for |x| up to pi/2 by Chebyshev interpolation in x^2.

    Truncation errors are below 1e-16.
    """
    z = x * x
    w = z * z
    v = w * w
    s1 = fused(z, 0.008333333333333316, -0.16666666666666666)
    s3 = fused(z, 2.755731921915122e-06, -0.00019841269841254928)
    s5 = fused(z, 1.6058977213318265e-10, -2.505210761546661e-08)
    s7 = fused(z, 2.7314053169647314e-15, -7.643967132130914e-13)
    sine = fused(x * z, fused(v, fused(w, s7, s5), fused(w, s3, s1)), x)
    c1 = fused(z, -0.0013888888888884754, 0.04166666666666666)
    c3 = fused(z, -2.7557318572071014e-07, 2.480158729890689e-05)
    c5 = fused(z, -1.1466247806337312e-11, 2.087668144643923e-09)
    c7 = fused(w, 4.646370352952837e-14, c5)
    half = 0.5 * z
    leading = 1.0 - half
    cosine = leading + fused(w, fused(v, c7, fused(w, c3, c1)), (1.0 - leading) - half)
    return sine, cosine


compile_as(sine_cosine, lambda x: (lanes_sine_cosine if holds_lanes(x) else sine_cosine, PART_FLAGS))
