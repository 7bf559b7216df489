"""Compute the height of a bounce from the stiffness of the contact."""

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress):
    return Content({}, {"height_m": inputs["drop"].summary["period_s"] / config.contact.stiffness})
