#!/usr/bin/env python3
"""Compare features of MuJoCo that exported models use or could use: make the table of docs/engines.md.

Usage: python scripts/mujoco_means.py [CONFIG ...], by default paper, level and kneed-round-feet

Each walker takes up to ten steps. The script prints the largest difference of a step's period and length from those of
our contact model, the depth of the stance foot at rest over that of our law (with the legs apart, and side by side),
and the processor time of a time step.
"""

import re
import sys
import time
from importlib.metadata import version
from pathlib import Path

import mujoco
import numpy as np

from walkerlab.api.memory import run_in_memory
from walkerlab.config.loader import load
from walkerlab.exchange.engine_scene import contact_target
from walkerlab.exchange.export import export_model
from walkerlab.exchange.exported import GaitStart, prepare_export
from walkerlab.exchange.mujoco_script import Walk

WALKERS = ("paper", "level", "kneed-round-feet")
BELT_M_S = -0.5


def without_pairs(text):
    """Define contacts by the feet instead of contact pairs. The damper of the feet then also acts in friction."""
    return re.sub(r"<contact>.*?</contact>", "", text, flags=re.DOTALL)


def with_option(text, option):
    return text.replace("<option ", f"<option {option} ", 1)


def with_flag(text):
    return re.sub(r"<option (.*?)/>", r'<option \1><flag diagexact="enable"/></option>', text, count=1)


def on_treadmill(text):
    """Let the ground move backwards. The walker moves with it at the start."""
    text = re.sub(r'(<geom name="pad_[^>]*?) ?/>', rf'\1 surfacevel="{BELT_M_S} 0 0 0 0 0"/>', text)
    return re.sub(r'qvel="(\S+)', lambda match: f'qvel="{float(match[1]) + BELT_M_S!r}', text)


MEANS = {
    "as exported": str,
    "without <pair>": without_pairs,
    "diagexact": with_flag,
    "discrete": lambda text: with_option(text, 'integrator="discrete"'),
    "discrete, 0.2 ms": lambda text: re.sub('timestep="[^"]*"', 'timestep="0.0002" integrator="discrete"', text),
    "surfacevel": on_treadmill,
}


def exported(name, *settings):
    """Return the text of the model, our walk, the penetration at rest by our force law, and whether the ground consists
    of pads.
    """
    config = load(Path(name), settings).config
    gait = run_in_memory("fixedpoint", config).summary
    start = GaitStart(gait["step_length_m"], gait["state"], gait["asymmetry"]["step_length"])
    export = prepare_export(config, start)
    text = next(iter(export_model(config, start, "mjcf").files.values()))
    return text, export.walk, contact_target(export.scene).penetration, export.scene.ground.terrain.has_pads


def take_steps(walk, steps):
    """Return the largest relative differences of periods and lengths from ours, and the processor time (s) of a time
    step.
    """
    belt = BELT_M_S if walk.model.flg_surfacevel else 0.0
    count = 0
    begun = time.process_time()
    while len(walk.touches_s) < steps.steps and walk.data.time < 1.5 * steps.end_time_s and walk.data.qpos[1] > 0.0:
        mujoco.mj_step(walk.model, walk.data)
        count += 1
    took = (time.process_time() - begun) / count
    touches = np.array(walk.touches_s)
    walked = np.diff(touches, prepend=0.0), np.diff(np.array(walk.touches_m) - belt * touches, prepend=0.0)
    taken = touches.size
    ours = steps.periods_s[:taken], steps.lengths_m[:taken]
    return taken, [np.abs(here / there - 1.0).max(initial=0.0) for here, there in zip(walked, ours, strict=True)], took


def depth_at_rest(model, depth, relative):
    """Return the penetration of the stance foot under the weight, over `depth`. The joints hold the pose.

    relative  factor on the angle between the legs in the pose of the gait
    """
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel[:] = 0.0
    hip = model.joint("hip")
    data.qpos[2] += 0.5 * (1.0 - relative) * data.qpos[hip.qposadr[0]]
    data.qpos[hip.qposadr[0]] *= relative
    foot = model.geom("foot_2").id
    pad = next(geom for geom in range(model.ngeom) if model.geom_conaffinity[geom] == model.geom_contype[foot])
    for margin in (model.pair_margin, model.geom_margin):
        margin[:] = 0.0
    model.geom_contype[np.arange(model.ngeom) != foot] = 0
    if model.npair:
        model.pair_margin[(model.pair_geom2 != foot) & (model.pair_geom1 != foot)] = -1.0
    mujoco.mj_kinematics(model, data)
    data.qpos[0] += model.geom_pos[pad, 0] - data.geom_xpos[foot, 0]
    top = model.geom_pos[pad, 2] + model.geom_size[pad, 2]
    data.qpos[1] += top + model.geom_size[foot, 0] - depth - data.geom_xpos[foot, 2]
    mujoco.mj_forward(model, data)
    lever = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, lever, None, data.geom_xpos[foot], model.geom_bodyid[foot])
    weight = -model.opt.gravity[2] * mujoco.mj_getTotalmass(model)
    data.qfrc_applied[:] = data.qfrc_bias - data.qfrc_passive - weight * lever[2]
    mujoco.mj_forward(model, data)
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, force)
    return weight / force[0]


def main(names):
    print(f"MuJoCo {version('mujoco')}")
    for name in names:
        text, steps, depth, steps_on_pads = exported(name)
        for means, change in MEANS.items():
            if change is on_treadmill and steps_on_pads:
                continue  # Pads would have to move with their surface.
            changed = change(text)
            mujoco.set_mjcb_control(None)
            model = mujoco.MjModel.from_xml_string(changed)
            # The force of a belt on the foot also depends on the damper in friction.
            still = not model.flg_surfacevel
            rests = [depth_at_rest(model, depth, relative) for relative in (1.0, 0.0) if still]
            taken, differences, took = take_steps(Walk(mujoco.MjModel.from_xml_string(changed)), steps)
            period, length = (f"{100.0 * difference:.2f} %" for difference in differences)
            print(f"{name}, {means}: {taken} of {steps.steps} steps, periods {period}, lengths {length}, ", end="")
            print(f"depths {np.round(rests, 4)}, {1e6 * took:.1f} us", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or WALKERS)
