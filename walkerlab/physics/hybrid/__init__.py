"""Walks as hybrid systems: smooth motion between events, jumps at them, and the ends of a walk.

Rigid model (`rigid_walk`; many walks side by side in `rigid_lanes`)
    modes         one foot on the slope, the swing knee BENT or STRAIGHT (`mechanics/rigid_model`)
    KNEE          the bent knee straightens: plastic strike, the knee locks; BENT -> STRAIGHT
    HEEL_STRIKE   the swing foot comes down with AHEAD positive: push-off if there is one, plastic strike, the legs
                  change roles, the step ends; STRAIGHT -> BENT, or STRAIGHT without knees
    HIP_FALL      the hip is too low, and the walk ends as a fall
    other ends    a heel strike with a bent knee, or no heel strike in time

Contact model (`contact_loop`)
    modes         forms of the walker (`ground/walker`): the first stance foot pinned or free, each knee locked or not;
                  in each form a foot has ground below it or not, and a knee is RELEASED, BENT, STOPPING or LOCKED
    each foot     HEIGHT: touch (`touch` decides whether it ends the step) or lift; LEFT_EDGE, RIGHT_EDGE: the
                  foot crosses an edge of a pad; RELEASE, FULL_DAMPING, FRICTION_SWITCHES: switching points of the
                  force law, at which solver steps end and nothing else happens; VERTICAL_VELOCITY: the leading foot
                  stops sinking in, and the trailing knee is released
    walker        PASSING: the feet pass each other, and each may gain or lose its ground; FALL: the hip is too low;
                  SLIDE: the stance foot has slid too far (both end the walk)
    each knee     EXTENSION: a bent knee becomes straight, and locks or meets its stop; EXTENSION_RATE: a knee turns
                  back in its stop, and latches
    timed         PULSE_END: the push-off ends, and a trailing knee that waited for its end is released
    other ends    no touch in time, too long a flight, a touch with a bent knee, a trip on a pad, a stubbed foot

| file | content |
|---|---|
| `endings` | codes by which kernels of both models report the end of a walk |
| `contact_state` | the events; the state apart from coordinates: stance, contacts, signs of the event functions |
| `contact_crossings` | event functions along a step, and their first zero |
| `contact_loop` | solver steps, and the search for the time of an event |
| `contact_transitions`, `contact_jumps` | effects of events on the walk state, and on velocities, energy and tangent |
| `contact_record` | samples and energy balance; the derivative with respect to the start |
| `contact_result` | a whole walk across changes of form, and its result |
| `rigid_walk`, `rigid_record`, `recorded_walk` | loop and events; samples and extremes; a whole walk and its result |
| `walk_record` | for both models: fields of every result; work of the hip torque |
| `rigid_measures`, `comparison` | energies and forces along a rigid walk; differences between two walks |
"""
