"""Check that energies of both models are measured from the same height: that of the stance foothold of each step."""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import contact_sim, fixedpoint, simulate

MODULES = {"fixedpoint": fixedpoint, "simulate": simulate, "contact-sim": contact_sim}
ARC_FOOTED = (
    "walker={type: straight-legs, leg_length_m: 1, leg_mass_kg: 1, leg_mass_below_hip_m: 0.5, foot_radius_m: 0.3}"
)
POINTS = "walker.foot_radius_m=0"  # The rigid model of a compass has point feet anyway.
WALKERS = {
    "paper": (POINTS,),
    "torso": (POINTS,),
    "round-feet": (ARC_FOOTED, "slope_deg=1", "contact.terrain=after-mid-swing"),
    "kneed": (),
    "kneed-round-feet": (),
}


@pytest.fixture(scope="module", params=WALKERS)
def walks(request):
    sets = [one for one in WALKERS[request.param] if "=" in one]
    base = None if request.param == "round-feet" else Path(request.param)
    config = load(base, (*sets, "strides=2")).config
    inputs = {}
    for stage, module in MODULES.items():
        inputs[stage] = module.run(restrict(config, PIPELINE[stage].takes), inputs, Silent())
    return {stage: inputs[stage] for stage in ("simulate", "contact-sim")}


def energy_of(content):
    trajectory, steps = content.groups["trajectory"].variables, content.groups["steps"].variables
    return trajectory["time"].values, trajectory["mechanical_J"].values, steps


def test_both_models_start_with_the_same_energy(walks):
    first = [energy_of(walks[stage])[1][0] for stage in ("simulate", "contact-sim")]
    assert first[0] == pytest.approx(first[1], abs=1e-9 * abs(first[0]))


def test_rigid_energy_is_constant_between_impacts_and_contact_energy_never_rises(walks):
    time, energy, steps = energy_of(walks["simulate"])
    impacts = np.sort(
        np.concatenate([steps[name].values for name in ("touch_time_s", "knee_strike_time_s") if name in steps])
    )
    phase = np.searchsorted(impacts, time, side="right")
    for one in np.unique(phase):
        assert np.ptp(energy[phase == one]) < 1e-9 * abs(energy[0])
    time, energy, steps = energy_of(walks["contact-sim"])
    step = np.searchsorted(steps["touch_time_s"].values, time, side="right")
    for one in np.unique(step):
        assert np.diff(energy[step == one]).max() < 1e-6 * abs(energy[0])
