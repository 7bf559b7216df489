"""ADAMS's cubic STEP function. Source: Adams function reference, STEP."""

from walkerlab.physics.kernels import kernel_part


@kernel_part
def smooth_step(x: float, x0: float, h0: float, x1: float, h1: float) -> tuple[float, float]:
    """Evaluate STEP(x, x0, h0, x1, h1) and its derivative: h0 before x0, h1 after x1, a cubic in between."""
    s = (x - x0) / (x1 - x0)
    if s <= 0.0:
        return h0, 0.0
    if s >= 1.0:
        return h1, 0.0
    return h0 + (h1 - h0) * s * s * (3.0 - 2.0 * s), 6.0 * (h1 - h0) * s * (1.0 - s) / (x1 - x0)
