"""Walks as hybrid systems: smooth motion between events, jumps at them, and the ends of a walk.

Rigid model (`rigid_walk`; many walks side by side in `rigid_lanes`)
    modes         one foot on the slope, the swing knee BENT or STRAIGHT (`mechanics/rigid_model`)
    KNEE          the bent knee straightens: plastic strike, the knee locks; BENT -> STRAIGHT
    HEEL_STRIKE   the swing foot comes down with AHEAD positive: plastic strike, a push-off before it, the legs change
                  roles; a step; STRAIGHT -> BENT, or STRAIGHT without knees
    HIP_FALL      the hip is too low: fell
    other ends    a heel strike with a bent knee, or none in time

Contact model (`contact_loop`)
    modes         forms of the tree (`ground/walker`): the first stance foot hinged or free, either knee locked or not;
                  in each a foot has ground or not, and a knee is RELEASED, BENT, STOPPING or LOCKED
    of each foot  HEIGHT: touch, which ends a step if it is far enough ahead, or lift; LEFT_EDGE, RIGHT_EDGE: the foot
                  changes its pad; RELEASE, FULL_DAMPING, FRICTION_SWITCHES: switching points of the force law, where
                  steps of the integration end and nothing else happens; VERTICAL_VELOCITY: the leading foot stops
                  sinking in, and the trailing knee is released
    of the walker PASSING: the feet pass each other, and the ground under either may come or go; FALL: fell;
                  SLIDE: the stance foot slid too far: slid
    of each knee  EXTENSION: a bent knee gets straight, and locks or meets its stop; EXTENSION_RATE: it turns back in
                  its stop, and latches
    no function   PULSE_END: the push-off is over, and a trailing knee that waited for that is released
    other ends    no touch in time, no foot on the ground for too long, a touch with a bent knee, off a pad, stubbed

| file | content |
|---|---|
| `endings` | codes with which kernels report the end of a walk, for both models |
| `contact_events`, `contact_crossings` | the events; their functions along a step, and the first zero |
| `contact_state` | the state of a walk besides its coordinates: stance, contacts, sides of the event functions |
| `contact_loop` | steps of the integration, and the search for the time of an event |
| `contact_transitions`, `contact_jumps` | effects of an event on the walk state; on velocities, energy and tangent |
| `contact_record`, `contact_tangent` | samples and energy balance; the derivative with respect to the start |
| `contact_result` | a whole walk in all its forms, and its result |
| `rigid_walk`, `rigid_record`, `recorded_walk` | loop and events; samples and extremes; a whole walk and its result |
| `walk_record`, `hip_work` | for both: fields of every result; work of the hip's torque |
| `rigid_measures`, `comparison` | energies and forces along a rigid walk; differences between two walks |
"""
