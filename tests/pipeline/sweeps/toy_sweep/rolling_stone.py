"""Compute how far the stone rolls after its fall."""

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress, again=True):
    way = config.strides * inputs["drop"].summary["period_s"]
    error = {"step_period_s": 1e-3 * config.strides, "end_time_s": 1e-9}
    if config.strides == 7:
        error = {"reason": "it stops"}
    return Content({}, {"outcome": "walked", "way_m": way, **({"numerical_error": error} if again else {})})
