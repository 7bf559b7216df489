"""Compute the height of a bounce from the contact's stiffness."""

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress):
    return Content({}, {"height_m": inputs["drop"].summary["period_s"] / config.contact.stiffness})
