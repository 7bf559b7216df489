"""Coefficients of Radau IIA of order 5: its collocation, and the transformation that splits its Newton systems.

Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), section IV.8.
"""

import math

ROOT6 = math.sqrt(6.0)
C = ((4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0, 1.0)
# eigenvalues of A^-1: one real, one complex pair; A^-1 = T Lambda T^-1, (8.5) and (8.12)
GAMMA = 3.0 + 3.0 ** (2.0 / 3.0) - 3.0 ** (1.0 / 3.0)
ALPHA = 3.0 + 0.5 * (3.0 ** (1.0 / 3.0) - 3.0 ** (2.0 / 3.0))
BETA = 0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0))
T_1 = (0.09443876248897524, -0.14125529502095421, 0.03002919410514742)
T_2 = (0.25021312296533332, 0.20412935229379994, -0.38294211275726192)  # the third row is (1, 1, 0)
INV_1 = (4.17871859155190428, 0.32768282076106237, 0.52337644549944951)
INV_2 = (-4.17871859155190428, -0.32768282076106237, 0.47662355450055044)
INV_3 = (0.50287263494578682, -2.57192694985560522, 0.59603920482822492)
# error estimate (8.19): h gamma_0 f(y_0) + sum e_i z_i, times gamma
ERROR = ((-13.0 - 7.0 * ROOT6) / 3.0, (-13.0 + 7.0 * ROOT6) / 3.0, -1.0 / 3.0)
# the collocation polynomial: z(s) = s (P_1 + s (P_2 + s P_3)), each a combination of z_1, z_2, z_3
P_1 = (13.0 / 3.0 + 7.0 * ROOT6 / 3.0, 13.0 / 3.0 - 7.0 * ROOT6 / 3.0, 1.0 / 3.0)
P_2 = (-23.0 / 3.0 - 22.0 * ROOT6 / 3.0, -23.0 / 3.0 + 22.0 * ROOT6 / 3.0, -8.0 / 3.0)
P_3 = (10.0 / 3.0 + 5.0 * ROOT6, 10.0 / 3.0 - 5.0 * ROOT6, 10.0 / 3.0)
