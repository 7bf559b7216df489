#!/usr/bin/env bash
# MuJoCo 4.0.0: with the integrator `discrete`, a pair's own damper in friction (solreffriction) gives another creep.
#
# A user would guess: `discrete` (3.13) evaluates the same spring-dampers at the end of the step, so a block that creeps
#   under a steady tangential load creeps as fast as with `Euler`, for small time steps at least.
# What happens: it does when friction uses the damper of solref. When a pair has its own, smaller damper in solreffriction,
#   with a larger impratio, the block creeps 34 times too slowly at a time step of 10 us, 84 times at 100 us: the result does
#   not converge to that of the other integrators. A walker that should creep on its feet walks like one on rigid ground.
# Source: the regularisation R of friction rows is R of the normal row over impratio; `discrete` rescales the normal row's
#   with the damper of solref (efc_R 19.58 instead of 999 at 10 us), and friction rows follow it, with another damper.
# Remedy: Euler or implicitfast with a smaller time step.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q mujoco==4.0.0 numpy==2.2.6
cat > creep.py <<'EOF'
import mujoco

K, C, D, MU, LOAD_N = 2e5, 5e3, 1e-3, 0.7, 1.0


def creep(integrator, step_s, impratio, damper):
    """Steady velocity (m/s) of a block of 1 kg, pressed on by 10 N and pushed sideways by LOAD_N."""
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option cone="elliptic" impratio="{impratio}" gravity="{LOAD_N} 0 -10" tolerance="1e-14" timestep="{step_s}"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" contype="0" conaffinity="0"/>
    <body pos="0 0 .1">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <geom name="foot" type="sphere" size=".1" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <contact><pair geom1="foot" geom2="floor" condim="3" friction="{MU} {MU} 0 0 0" solref="{-K} {-C}"
    solreffriction="0 {-damper}" solimp="{D} {D} 1 .5 1"/></contact>
</mujoco>""")
    model.opt.integrator = integrator
    data = mujoco.MjData(model)
    data.qpos[1] = -(1 - D) * 10 / K
    mujoco.mj_step(model, data, round(0.2 / step_s))
    return data.qvel[0]


integrators = mujoco.mjtIntegrator
print(f"MuJoCo {mujoco.__version__}; expected, as the pair says: (1 - d) load / (impratio damper)")
for impratio, damper in ((1.0, C), (10.0, 50.0)):
    expected = (1 - D) * LOAD_N / (impratio * damper)
    for step_s in (1e-5, 1e-4):
        euler, discrete = (creep(one, step_s, impratio, damper) for one in (integrators.mjINT_EULER, integrators.mjINT_DISCRETE))
        print(f"impratio {impratio:g}, damper {damper:g}, time step {step_s:g} s: expected {1e3 * expected:.4f} mm/s;"
              f" actual with Euler {1e3 * euler:.4f}, with discrete {1e3 * discrete:.4f}")
        assert abs(euler / expected - 1) < 1e-6, "behaviour has changed: Euler"
        if damper == C:
            assert abs(discrete / expected - 1) < 0.01, "behaviour has changed: one damper"
        else:
            assert expected / discrete > 10, "behaviour has changed: discrete"
EOF
venv/bin/python creep.py
