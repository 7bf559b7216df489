"""Simulate as many steps as requested, each of which is a fall."""

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress):
    period = inputs["drop"].summary["period_s"] if config.start == "fixed-point" else config.start[1]
    left_out = [{"what": "forces", "why": "a stone has none"}]
    return Content({}, {"steps": 2 * config.strides, "duration_s": 2 * config.strides * period, "left_out": left_out})
