"""It rolls on."""

from walkerlab.store.content import Content


def run(config, inputs, progress):
    return Content({}, {"outcome": "walked", "way_m": config.strides * inputs["drop"].summary["period_s"]})
