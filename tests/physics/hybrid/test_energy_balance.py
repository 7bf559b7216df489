"""Check that walks whose energy does not balance are rejected everywhere, except where methods are tested."""

import contact_walks
import numpy as np
import pytest
from contact_walks import FIXED_POINT, RIGID_STEP, scene_of, settings

from walkerlab.errors import NoAnswer
from walkerlab.evidence.benchmarks.trials import ContactTrial
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.hybrid import contact_result
from walkerlab.physics.hybrid.contact_result import walk_contact
from walkerlab.physics.orbits.contact_gait import find_gait_from
from walkerlab.physics.orbits.contact_map import step_from_section
from walkerlab.physics.orbits.scaled_starts import scaled_starts
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import contact_sim
from walkerlab.scene.contact import start_state

# m, rad, m/s, rad/s: a state near the gait, with the legs upright side by side
FEET_ABREAST = np.array([0.875, 0.0, 0.5, 0.0, 1.0, -0.5])


@pytest.fixture
def nothing_explained(monkeypatch):
    """Let every energy residual that is not zero be rejected."""
    monkeypatch.setattr(contact_result, "RESIDUAL_FACTOR", 0.0)


def test_walk_with_inconsistent_equations_is_rejected_with_its_residual():
    """The motion is that of a walker with a heavier hip, but the energy is computed without the extra mass."""
    scene, heavier = scene_of("contact.stance=pinned"), scene_of("contact.stance=pinned", "walker.hip_mass_kg=20")
    forms = scene.walker.forms.copy()
    forms[1] = heavier.walker.forms[1]
    taken = walk_contact(
        scene.walker._replace(forms=forms),
        scene.ground,
        True,
        STANCE_FOOT,
        start_state(scene, FIXED_POINT),
        settings(method="scipy-radau"),
        1,
        None,
    )
    assert taken.outcome is Outcome.SOLVER_FAILED
    assert not taken.outcome.answered
    assert f"off by {taken.energy_balance_residual_J:.3g} J" in taken.advice
    assert taken.energy_balance_residual_J > 0.01  # J; an error of five kilograms is larger than any rounding


def test_explained_residual_grows_with_the_tolerance():
    loose, tight = (contact_walks.walked(steps=1, tolerance=tolerance) for tolerance in (1e-5, 1e-8))
    # The energy turned into heat changes little.
    assert loose.explained_residual_J == pytest.approx(1e3 * tight.explained_residual_J, rel=1e-3)
    assert tight.energy_balance_residual_J < tight.explained_residual_J


def test_contact_sim_fails_on_an_unexplained_energy_residual_and_reports_it(nothing_explained):
    scene_sets = ("slope_deg=1", f"start={list(FIXED_POINT)}", f"contact.pad_pitch={RIGID_STEP}", "outputs=[]")
    with pytest.raises(NoAnswer) as refused:
        contact_sim.run(contact_walks.load(None, scene_sets).config, {}, Silent())
    assert refused.value.partial.summary["outcome"] == "solver-failed"
    residual = refused.value.partial.summary["energy_balance_residual_J"]
    assert 0.0 < residual < 1e-3
    assert f"off by {residual:.3g} J" in refused.value.advice


def test_searches_and_maps_ignore_walks_with_unbalanced_energy(nothing_explained):
    scene = scene_of()
    ground, start = scene.ground, start_state(scene, FIXED_POINT)
    starts = scaled_starts(scene.walker, ground, lambda *_: start, 2, None)
    assert starts.walk(1.0, 1.0).outcome == Outcome.SOLVER_FAILED
    assert step_from_section(scene, settings(), FEET_ABREAST, RIGID_STEP).outcome is Outcome.SOLVER_FAILED
    assert find_gait_from(scene.walker, ground, settings(), start).gait is None


def test_benchmark_does_not_reject_a_walk_for_its_energy_residual(nothing_explained):
    scene = scene_of()
    ground, start = scene.ground, start_state(scene, FIXED_POINT)
    trial = ContactTrial(scene.walker, ground, start, 1, "contact")
    assert trial.prepare("radau5", 1e-3, 100_000)().outcome == "walked"


def test_energy_balance_of_dop853_closes_well_within_its_tolerance():
    """A rule of order 5 on steps of order 8 would leave a residual of two hundredths of the tolerance here, and more
    than all of it with bouncing feet.
    """
    walk = contact_walks.walked(steps=3, method="dop853")
    assert walk.energy_balance_residual_J < 1e-3 * walk.explained_residual_J


def test_stiff_walk_that_exhausts_dop853_advises_radau5():
    walk = contact_walks.walked(steps=3, method="dop853", budget=3000)
    assert walk.outcome is Outcome.BUDGET_EXHAUSTED
    assert "solver.contact.method to radau5" in walk.advice
    assert "rtol" not in walk.advice
