"""Jumps of velocities, energy and tangent where a knee locks, latches or is released."""

from typing import Any

import numpy as np

from walkerlab.physics.energy_channels import KNEE_STOP, KNEE_STRIKES
from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.hinges import hinge_energies
from walkerlab.physics.ground.knees import lock_knee
from walkerlab.physics.ground.motion import motion_gradient
from walkerlab.physics.ground.walker import BODY_VECTOR, STOPPING, ContactWalker, GroundModel, OnGround
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid.contact_record import ContactObserver
from walkerlab.physics.kernels import vector
from walkerlab.physics.mechanics.tree import projections
from walkerlab.physics.solvers.scipy_methods import right_hand_side
from walkerlab.physics.solvers.stepping import T
from walkerlab.physics.solvers.system import Floats


def change_form(
    walker: ContactWalker, before: OnGround, after: OnGround, event: int, observer: ContactObserver, method: Any
) -> Floats:
    """Return the state in the walker's new form after an event.

    Records the energy lost and updates the tangent.
    """
    # Locks and latches are plastic impacts. A latch also loses the elastic energy of its stop. A release changes no
    # velocity. The tangent jumps at all of these, and at a step's touch if the hip's torque then acts on the other leg.
    # A push-off starts at that touch, so with a push-off the tangent compares walks at equal times since the touch.
    y = method.y
    t = float(method.clock[T])
    # the form that has the same root, with all bodies separate
    whole = walker.forms[int(before.form.places == 0), 0]
    size = int(2 * (whole.places + whole.bodies))
    Phi = observer.tangent.Phi
    x = forms.to_full(before.form, y, size)
    columns = forms.to_full(before.form, Phi[: y.size], size)
    waits = np.zeros(Phi.shape[1])
    ends_step = event < events.PASSING and event % events.PER_FOOT == events.HEIGHT
    # The touch has already exchanged the roles of the legs. Before it, the other leg was the stance leg.
    if ends_step:
        before = before._replace(progress=forms.new_progress(stance=1 - after.progress.stance))
    if events.EXTENSION_RATE <= event < events.PULSE_END:
        # `before.knee` shares its memory with the walk state, in which the event has already latched this knee. Before
        # the event, the stop acted.
        stopping = before.knee.copy()
        stopping[(event - events.EXTENSION) % 2] = STOPPING
        before = before._replace(knee=stopping)
        observer.account[KNEE_STOP] += hinge_energies(before, y)[1]
    if waits.size > 0:
        rate = state_rate(before, y, size, t)
        # A changed state reaches the event at a different time. But a pulse ends at a fixed time after the touch.
        if event != events.PULSE_END:
            gradient = event_gradient(whole, event, x)
            waits = -(gradient @ columns) / (gradient @ rate)
        # saltation: shift the columns from fixed time to the time of the event
        columns += np.outer(rate, waits)
    if events.EXTENSION <= event < events.PULSE_END:
        x, lost, columns = lock_knee(whole, after.form, x, columns)
        observer.account[KNEE_STRIKES] += lost
    z = forms.to_form(after.form, x)
    if waits.size > 0:
        starts_push = ends_step and before.form.push_off != 0.0
        rate_after = np.zeros(size) if starts_push else state_rate(after, z, size, t)
        Phi[: z.size] = forms.to_form(after.form, columns - np.outer(rate_after, waits))
    return z


def state_rate(system: OnGround, y: Floats, size: int, t: float) -> Floats:
    rate = np.zeros(y.size)
    right_hand_side(system, t, y, rate)
    return forms.to_full(system.form, rate, size)


def event_gradient(whole: GroundModel, event: int, x: Floats) -> Floats:
    gradient = np.zeros(x.size)
    p = int(whole.places)
    half = x.size // 2
    if event >= events.EXTENSION:
        first = half + p if event >= events.EXTENSION_RATE else p
        knee = (event - events.EXTENSION) % 2
        gradient[first + whole.knees[knee]] = 1.0, -1.0
        return gradient
    foot = event // events.PER_FOOT
    row = 0 if event % events.PER_FOOT == events.HEIGHT else 1
    s, c, F, U = vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR)
    forms.sines_cosines(whole, x, s, c)
    projections(whole.foot_x[foot], whole.foot_y[foot], whole.bodies, s, c, F, U)
    # `motion_gradient` differentiates the penetration, which is minus the height.
    return -np.array([motion_gradient(whole, foot, F, U, x, j)[row] for j in range(x.size)])
