"""Compare derivatives of a kneed walker's step on compliant ground with differences."""

import numpy as np
import pytest
from kneed_walks import AT_TOUCH, RIGID_ANGLES, RIGID_RATES, STEP, scene_of

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.compliant import KneeRules
from walkerlab.physics.orbits.contact_gait import section_points
from walkerlab.physics.orbits.contact_map import step_from_section
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import start_state

TOLERANCES = Tolerances("radau5", 1e-10, 1e-12, 10**7)


@pytest.mark.parametrize("rules", [KneeRules(), AT_TOUCH], ids=["compression", "touch"])
def test_step_derivative_equals_finite_differences(rules):
    scene = scene_of(rules)
    start = start_state(scene, (*RIGID_ANGLES, *RIGID_RATES))
    _, z = next(section_points(scene.walker, scene.ground, TOLERANCES, start))

    def step(z):
        taken = step_from_section(scene, TOLERANCES, z, STEP)
        assert taken.outcome is Outcome.WALKED
        return taken

    # Height and vertical velocity of the stance foot have the scale of the contact, which is far smaller.
    sizes = np.full(z.size, 1e-6)
    sizes[0] = 1e-8
    columns = []
    for j, size in enumerate(sizes):
        change = np.zeros(z.size)
        change[j] = size
        columns.append((step(z + change).z - step(z - change).z) / (2.0 * size))
    differences = np.column_stack(columns)
    np.testing.assert_allclose(step(z).DP, differences, atol=2e-4 * np.abs(differences).max())
