"""Estimation of a walker from a measured walk: prediction of steps and angles, likelihood, fit, and its uncertainty.

Steps follow z' = P(z; p) + w: the floor's heights, independent and normally distributed about the slope, disturb each
step, and one height disturbs period and length of several steps together. What is measured of a step has noise of its
own, one standard deviation per quantity. About the walk over the most probable heights the measured values y are

    y = f(p, z0; h) + G h + v,   h ~ N(0, roughness^2),   v ~ N(0, noise^2)

with unknown parameters p and start z0. Given both standard deviations, p and z0 minimise the whitened residuals; both
standard deviations maximise the restricted likelihood, which accounts for the parameters fitted to the same data.

Source: Harville, Maximum likelihood approaches to variance component estimation, J. Am. Stat. Assoc. 72 (1977); with
heights as the random effects.
"""
