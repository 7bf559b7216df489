"""Friction that rises with the slip velocity as a hyperbolic tangent, and its figure."""

from walkerlab.extensions import Extension

EXTENSION = Extension(1, friction={"tanh": "tanh_friction.law:Tanh"}, figures="tanh_friction.figure:FIGURES")
