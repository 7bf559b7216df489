"""Physics of walkers in SI units: mechanics, ground contact, solvers, hybrid walks and their orbits.

Nothing here reads a config, a file or a study. `kernels`, `compiler` and `kernel_cache` compile the functions.
"""
