"""Estimation of a walker from a measured walk: prediction of steps and angles, likelihood, fit, and uncertainty.

Steps follow z' = P(z; p) + w with the step map P. The disturbances w come from the heights of the floor, which are the
random effects. They are independent and normally distributed about the slope, and each affects the periods and lengths
of several steps. The noise of each measured quantity has its own standard deviation. Linearised about the walk over the
most probable heights, the measured values y are

    y = f(p, z0; h) + G h + v,   h ~ N(0, roughness^2),   v ~ N(0, noise^2)

with unknown parameters p and start z0. For known standard deviations, p and z0 minimise the whitened residuals. The
standard deviations maximise the restricted likelihood, which allows for the parameters being fitted to the same data.

Source: Harville, Maximum likelihood approaches to variance component estimation, J. Am. Stat. Assoc. 72 (1977).
"""
