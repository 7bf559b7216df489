"""Tests of the texts in figures of an identification."""

import numpy as np
import pytest

from walkerlab.views.figures.identification import describe_combination

MASS = {"key": "walker.hip_mass_kg", "value": 10.0, "unit": "kg"}
OFFSET = {"key": "angle_offset_rad", "value": 0.0, "unit": "rad"}
LENGTH = {"key": "walker.leg_length_m", "value": 0.4, "unit": "m"}


@pytest.mark.parametrize(
    ("rows", "move", "words"),
    [
        ([MASS], [6.6e-6], "hip mass + 0.000066 %"),
        ([MASS, LENGTH], [-2.5, 0.076], "hip mass + 25 %, leg length − 19 %"),
        ([MASS, LENGTH], [15.0, 1e-4], "hip mass + 150 %"),
        ([OFFSET], [-0.02], "angle offset + 0.02 rad"),
    ],
)
def test_parameters_that_change_together_are_listed_with_their_shares(rows, move, words):
    assert describe_combination(rows, np.array(move)) == words
