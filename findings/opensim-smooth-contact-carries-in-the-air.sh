#!/usr/bin/env bash
# OpenSim 4.6: `constant_contact_force` of SmoothSphereHalfSpaceForce is no force, and a light walker hangs in the air.
#
# What one would guess: it adds a constant force, as its name, its unit (1e-5 N) and the class's documentation say, so the default
# does not matter. Apart from smoothing, the force is that of HuntCrossleyForce with the same numbers.
# What happens: it is added to the *square* of the depth, so it is in m^2, and the default is a depth of 3.2 mm in Hertz's force,
# whatever the stiffness. With a foot of public gait models (3.07 MN/m^2, radius 32 mm) a sphere that just touches carries 23 N,
# as HuntCrossleyForce does 2 mm deep. Under 1 kg that foot rests 3.3 mm *above* the ground, and one of 100 MN/m^2 12 mm above it.
# A smaller number alone does not help: with 1e-9 (a depth of 0.03 mm) the force at touch is 0.02 N, but 4.3 N are left 5 mm above
# the ground: a square has no sign, and the tanh of `hertz_smoothing` is wider than any depth. Zero gives nan.
# Instead: constant_contact_force = 1e-9 and hertz_smoothing = 30,000 (1/m), which rest where HuntCrossleyForce does.
# Versions: opensim 4.6, numpy 2.4.6, November 2026. Source: Simbody, SmoothSphereHalfSpaceForce.cpp (`cf`, also added to the
# square of the slip velocity); opensim-core's documentation of the class, which promises a constant force.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check opensim==4.6 numpy==2.4.6
cat > foot.py <<'EOF'
from importlib.metadata import version

import numpy as np
import opensim

opensim.Logger.setLevelString("error")
RADIUS = 0.032
SOFT = 3_067_776.0
HARD = 1e8
GRAVITY = 9.81


def normal_force(law, stiffness, constant=1e-5, smoothing=300.0):
    """Return the function from the height of the sphere's lowest point (m) to the force on it (N)."""
    model = opensim.Model()
    foot = opensim.Body("foot", 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
    model.addBody(foot)
    upright = opensim.Vec3(0, 0, np.pi / 2)
    guide = opensim.SliderJoint("guide", model.getGround(), opensim.Vec3(0), upright, foot, opensim.Vec3(0), upright)
    model.addJoint(guide)
    floor = opensim.ContactHalfSpace(opensim.Vec3(0), opensim.Vec3(0, 0, -np.pi / 2), model.getGround(), "floor")
    sphere = opensim.ContactSphere(RADIUS, opensim.Vec3(0), foot, "sphere")
    model.addContactGeometry(floor)
    model.addContactGeometry(sphere)
    if law == "HuntCrossleyForce":
        force = opensim.HuntCrossleyForce()
        force.addGeometry("sphere")
        force.addGeometry("floor")
        force.setStiffness(stiffness)
        force.setDissipation(0.0)
    else:
        force = opensim.SmoothSphereHalfSpaceForce("contact", sphere, floor)
        force.set_stiffness(stiffness)
        force.set_dissipation(0.0)
        assert force.get_constant_contact_force() == 1e-5 and force.get_hertz_smoothing() == 300.0
        force.set_constant_contact_force(constant)
        force.set_hertz_smoothing(smoothing)
    force.setName("contact")
    model.addForce(force)
    state = model.initSystem()

    def at(height):
        guide.getCoordinate().setValue(state, RADIUS + height)
        model.realizeDynamics(state)
        return force.getRecordValues(state).get(1)

    return at


def highest_rest(force):
    """Return the greatest height (m) at which the force carries 1 kg, where the foot comes to rest from above."""
    heights = np.linspace(0.03, -0.005, 3_501)
    return next(height for height in heights if force(height) >= GRAVITY)


print(f"opensim {version('opensim')}")
for name, stiffness in (("3.07 MN/m^2", SOFT), ("100 MN/m^2", HARD)):
    plain = normal_force("HuntCrossleyForce", stiffness)
    smooth = normal_force("SmoothSphereHalfSpaceForce", stiffness)
    small = normal_force("SmoothSphereHalfSpaceForce", stiffness, constant=1e-9)
    steep = normal_force("SmoothSphereHalfSpaceForce", stiffness, constant=1e-9, smoothing=30_000.0)
    print(f"{name}: force at touch, 5 mm above, -2 mm (N); height at rest under 1 kg (mm)")
    for law, force in (("HuntCrossley", plain), ("smooth", smooth), ("smooth, 1e-9", small), ("1e-9, steep", steep)):
        values = [force(height) for height in (0.0, 0.005, -0.002)]
        print(f"  {law:13s} {values[0]:9.3f} {values[1]:9.3f} {values[2]:9.2f}   {1000 * highest_rest(force):7.3f}")
    expected = plain(-np.sqrt(1e-5)) / 2
    print(f"  expected at touch 0.00001, actual {smooth(0.0):.2f}; half of HuntCrossley's at sqrt(1e-5) m = {expected:.2f}")
    assert abs(smooth(0.0) / expected - 1) < 1e-6, "behaviour has changed"
    assert highest_rest(plain) < 0 < highest_rest(smooth), "behaviour has changed"
    assert small(0.005) > 100 * small(0.0), "behaviour has changed"
    assert highest_rest(steep) < 0, "behaviour has changed"
assert np.isnan(normal_force("SmoothSphereHalfSpaceForce", SOFT, constant=0.0)(-0.002)), "behaviour has changed"
EOF
venv/bin/python foot.py
