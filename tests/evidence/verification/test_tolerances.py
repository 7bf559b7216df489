"""Check that a case ends in the same way at every tolerance."""

import numpy as np
import pytest

from walkerlab.evidence.verification.catalogue import config_of, package_cases
from walkerlab.evidence.verification.starts import prepare_start
from walkerlab.outcome import Outcome


@pytest.fixture(scope="module")
def case():
    (found,) = (case for case in package_cases() if case.name == "no-hip-mass")
    return found


def test_lightest_walker_takes_the_same_steps_at_every_tolerance(case):
    """For its mass, it has the strongest damping of the feet. If a velocity is computed as a difference, such walks end
    by chance.
    """
    start = prepare_start(config_of(case), case)
    walks = [start.walk(case, start.tolerances(case, tighter)) for tighter in (2.0, 1.0, 0.7, 0.3, 0.15, 0.05, 0.01)]
    assert {walk.outcome for walk in walks} == {Outcome.WALKED}
    touches = np.array([walk.touches for walk in walks])
    assert np.abs(touches - touches[-1]).max() < 1e-6
