"""Description of a walker by ADAMS objects (parts, markers, joints, forces, requests), in N, mm, kg and s.

The walk takes place in the x-y plane, x along the slope and y normal to it. Gravity is tilted.
In expressions, markers and variables stand in braces, as in DX({leg_1.foot}). Each file format replaces them with its
own names.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

from walkerlab.errors import ConfigError
from walkerlab.exchange.exported import Exported, finite
from walkerlab.physics.ground.friction import Coulomb, Frictionless
from walkerlab.physics.ground.knees import MIN_FLEXION
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.mechanics.parts import Position
from walkerlab.scene.contact import knee_rules
from walkerlab.scene.parts import TORSO, knee_dampings

MM = 1000.0
GROUND = "ground"
ORIGIN = "ground.origin"
BELOW = "ground.below"
FREE_LENGTH_MM = 100.0
"""Free length in IMPACT for a point foot. The marker from which foot heights are measured is at this depth in the
ground.
"""
PAD_MM = 50.0
"""Thickness of the pads."""
LEGS = ("leg_1", "leg_2")
FRICTION_NAMES = ("mu_static", "mu_dynamic", "stiction_transition_velocity", "friction_transition_velocity")
"""ADAMS names for the fields of `Coulomb`, in the same order."""
REFERENCE = re.compile(r"\{([\w.]+)\}")
"""Name of a marker or variable in an expression."""
OUTPUT_S = 1e-3
"""Time between the outputs of a simulation."""
TIME_FACTOR = 1.05
"""Maximum simulated time between events, as a multiple of the duration of walkerlab's walk."""
ERROR_RAD = 1e-6
ERROR_MM = 1e-6
"""Tolerances of sensors. The default of ADAMS is 1e-3 in the unit of the expression."""
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Marker:
    """Point of a part, in the part's frame (mm). A floating marker follows the point at which a reaction acts."""

    part: str
    place: Place = (0.0, 0.0, 0.0)
    floating: bool = False


@dataclass(frozen=True)
class Part:
    """Rigid body. Units are mm, rad, mm/s, rad/s, kg and kg mm^2."""

    place: tuple[float, float]
    angle: float
    velocity: tuple[float, float]  # velocity of the centre of mass
    spin: float
    mass: float
    centre: str  # name of the marker at the centre of mass
    inertia: float


@dataclass(frozen=True)
class Joint:
    """Constraint between two markers: PLANAR, REVOLUTE, or the primitive INLINE."""

    kind: str
    i: str
    j: str


@dataclass(frozen=True)
class Shape:
    """Ellipsoid around a marker, or box with a corner at it. `size` holds its diameters or edge lengths (mm)."""

    kind: str
    marker: str
    size: Place


@dataclass(frozen=True)
class AdamsContact:
    """ADAMS contact between a foot and its pads."""

    foot: str
    pads: tuple[str, ...]
    normal: dict[str, float]  # parameters of the normal force by their names in ADAMS, in N, mm, s
    friction: dict[str, float]  # parameters of the friction, in mm/s; empty if there is no friction


@dataclass(frozen=True)
class Force:
    """In-plane force (N) and torque (N mm) on a marker, as expressions. The ground takes the reaction."""

    i: str
    reaction: str
    x: str
    y: str
    torque: str


@dataclass(frozen=True)
class Torque:
    """Torque (N mm) on the part of marker `i`. Its reaction acts on the part of marker `j`."""

    i: str
    j: str
    function: str


@dataclass(frozen=True)
class Sensor:
    """Condition that ends a simulation: an expression reaches zero from below. If `halts` is true, it stops the whole
    run.
    """

    function: str
    error: float
    halts: bool = False


@dataclass(frozen=True)
class Event:
    """Sensor that a run waits for, and the objects to activate and deactivate when it triggers."""

    sensor: str
    activated: tuple[str, ...] = ()
    deactivated: tuple[str, ...] = ()


@dataclass
class AdamsModel:
    """All objects of a model by name, in the order in which they are written."""

    name: str
    gravity: tuple[float, float]  # mm/s^2
    parts: dict[str, Part] = field(default_factory=dict)
    markers: dict[str, Marker] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    couplers: dict[str, dict[str, float]] = field(default_factory=dict)  # weights of joints by coupler
    shapes: dict[str, Shape] = field(default_factory=dict)
    outlines: dict[str, tuple[str, ...]] = field(default_factory=dict)
    contacts: dict[str, AdamsContact] = field(default_factory=dict)
    variables: dict[str, str] = field(default_factory=dict)
    forces: dict[str, Force] = field(default_factory=dict)
    torques: dict[str, Torque] = field(default_factory=dict)
    motions: dict[str, str] = field(default_factory=dict)  # joints whose rate is held at zero
    sensors: dict[str, Sensor] = field(default_factory=dict)
    requests: dict[str, dict[str, str]] = field(default_factory=dict)
    inactive: tuple[str, ...] = ()  # objects that are deactivated at the start
    events: list[Event] = field(default_factory=list)  # in the order of walkerlab's walk

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Number by which ADAMS identifies each object. Objects of each kind are counted from 1."""
        primitives = [name for name, joint in self.joints.items() if joint.kind == "INLINE"]
        # ADAMS numbers primitives separately from joints.
        joints = [name for name in self.joints if name not in primitives]
        kinds = (
            self.markers, [*self.shapes, *self.outlines], joints, primitives, self.couplers, self.contacts,
            self.variables, self.forces, self.torques, self.motions, self.sensors,
        )  # fmt: skip
        return {name: number for kind in kinds for number, name in enumerate(kind, start=1)}

    def commands(self, end_s: float, pinned_until_s: float | None) -> Iterator[str]:
        """Yield the solver commands that simulate the walk. A script for Adams View contains them, too.

        end_s           end of walkerlab's walk (s)
        pinned_until_s  time (s) at which a pinned stance foot is released, or None if no foot is pinned
        """
        run = f"simulate/dynamic, end = {{}}, dtout = {finite(OUTPUT_S)}"
        if pinned_until_s is not None:
            yield from (run.format(finite(pinned_until_s)), self.switch("deactivate", "pin"))
        yield from (self.switch("deactivate", name) for name in self.inactive)
        for event in self.events:
            yield self.switch("activate", event.sensor)
            # Simulate longer than the walk took, so that a slower walk still reaches its last event.
            yield run.format(finite(TIME_FACTOR * end_s))
            yield from (self.switch("deactivate", name) for name in (event.sensor, *event.deactivated))
            yield from (self.switch("activate", name) for name in event.activated)
        if not self.events:
            yield run.format(finite(end_s))

    def switch(self, word: str, name: str) -> str:
        """Return the command that activates or deactivates the object `name`, depending on `word`."""
        kinds = (("motion", self.motions), ("sensor", self.sensors), ("sforce", self.torques), ("jprim", self.joints))
        kind = next(kind for kind, objects in kinds if name in objects)
        return f"{word}/{kind}, id = {self.numbers[name]}"

    def shape_name(self, shape: str) -> str:
        """Return the name of a shape, preceded by that of the part to which it belongs."""
        return f"{self.markers[self.shapes[shape].marker].part}.{shape}"


def adams_model(export: Exported, law: str) -> AdamsModel:
    """Build the ADAMS model of an export, with ADAMS contact (law `contact`) or walkerlab's law (`functions`).

    Raises ConfigError for a contact law, ground or coupling that cannot be expressed.
    """
    gravity = MM * export.model.gravity_along, -MM * export.model.gravity_down
    model = AdamsModel(export.model_name, gravity, markers={ORIGIN: Marker(GROUND)})
    add_bodies(model, export)
    add_ground(model, export)
    if law == "contact":
        add_contacts(model, export)
    else:
        add_normal_and_friction(model, export)
    add_push_offs(model, export)
    add_forces(model, export)
    add_hip(model, export)
    if export.knee_links:
        add_knees(model, export)
    add_requests(model, export, law)
    return model


def values(*numbers: float) -> str:
    return ", ".join(finite(number) for number in numbers)


class MovingFrame(NamedTuple):
    """Motion of a frame that is fixed to a body, in SI units or in mm."""

    place: Position
    angle: float
    velocity: Position
    spin: float

    def moved_to(self, point: Position) -> "MovingFrame":
        """Return the parallel frame with its origin at a point of this frame."""
        s, c = math.sin(self.angle), math.cos(self.angle)
        x, y = c * point[0] - s * point[1], s * point[0] + c * point[1]
        velocity = self.velocity[0] - self.spin * y, self.velocity[1] + self.spin * x
        return MovingFrame((self.place[0] + x, self.place[1] + y), self.angle, velocity, self.spin)


def marker_at(part: str, point_m: Position, across_m: float = 0.0) -> Marker:
    """Return a marker at a point of a part, at the signed distance `across_m` from the plane of the walk."""
    return Marker(part, (MM * point_m[0], MM * point_m[1], MM * across_m))


def add_bodies(model: AdamsModel, export: Exported) -> None:
    """Add parts, markers, hinges, feet and couplers. A planar joint keeps the base in the plane of the walk."""
    names = export.names
    q, v = ([float(x) for x in part] for part in export.start)
    frames: list[MovingFrame] = []
    for k, (name, link) in enumerate(zip(names, export.model.links, strict=True)):
        hinge = MovingFrame((q[0], q[1]), q[2], (v[0], v[1]), v[2])
        if link.parent >= 0:
            held = frames[link.parent].moved_to(link.parent_point_m)
            hinge = held._replace(angle=held.angle + q[2 + k], spin=held.spin + v[2 + k])
        frame = hinge.moved_to((-link.point_m[0], -link.point_m[1]))
        frames.append(frame)
        x, y = frame.place
        vx, vy = frame.moved_to(link.centre_m).velocity
        model.markers |= {f"{name}.cm": marker_at(name, link.centre_m), f"{name}.hinge": marker_at(name, link.point_m)}
        model.parts[name] = Part(
            (MM * x, MM * y), frame.angle, (MM * vx, MM * vy), frame.spin, link.mass_kg, f"{name}.cm",
            link.inertia_kg_m2 * MM**2,
        )  # fmt: skip
        if link.parent < 0:
            model.joints["plane_of_walk"] = Joint("PLANAR", f"{name}.hinge", ORIGIN)
        else:
            on_parent = f"{names[link.parent]}.hinge_of_{name}"
            model.markers[on_parent] = marker_at(names[link.parent], link.parent_point_m)
            model.joints[f"hinge_of_{name}"] = Joint("REVOLUTE", f"{name}.hinge", on_parent)
    for number, coupling in enumerate(export.couplings):
        weights = {f"hinge_of_{names[link]}": weight for link, weight in coupling.items()}
        model.couplers[f"coupler_{number + 1}"] = weights
    for foot, ball in enumerate(export.model.balls):
        # Parts turn only about the plane's normal, so each ball stays in its lane, at a fixed distance from the plane.
        name = names[ball.link]
        model.markers[f"{name}.foot"] = marker_at(name, ball.centre_m)
        model.markers[f"{name}.ball"] = marker_at(name, ball.centre_m, export.lane_across_m(foot))
        diameter = 2.0 * MM * ball.radius_m
        model.shapes[f"ball_{foot + 1}"] = Shape("ELLIPSOID", f"{name}.ball", (diameter, diameter, diameter))
        model.outlines[f"line_{foot + 1}"] = (f"{name}.hinge", f"{name}.foot")
    if export.pinned:
        foot_on_ground = FootTerms(export, STANCE_FOOT)
        part, (x, y, _) = model.parts[foot_on_ground.part], model.markers[foot_on_ground.marker].place
        place = MovingFrame(part.place, part.angle, part.velocity, part.spin).moved_to((x, y)).place
        model.markers[f"{GROUND}.pin"] = Marker(GROUND, (*place, 0.0))
        # The planar joint of the base already holds the foot in the plane. A hinge would do so again, but INLINE only
        # fixes the point.
        model.joints["pin"] = Joint("INLINE", foot_on_ground.marker, f"{GROUND}.pin")


@dataclass(frozen=True)
class FootTerms:
    """ADAMS expressions for the motion of a foot relative to the ground."""

    export: Exported
    foot: int

    @property
    def part(self) -> str:
        return self.export.names[self.export.model.balls[self.foot].link]

    @property
    def marker(self) -> str:
        return f"{self.part}.foot"

    @property
    def radius(self) -> float:
        """Radius of the foot (mm)."""
        return MM * float(self.export.scene.ours.whole.radius[self.foot])

    def place(self, base: str = ORIGIN) -> str:
        """Return the arguments for ADAMS functions that measure the position of the foot relative to the marker
        `base`.
        """
        return f"{{{self.marker}}},{{{base}}},{{{ORIGIN}}}"

    @property
    def motion(self) -> str:
        """Arguments for ADAMS functions that measure the velocity of the foot relative to the ground."""
        return f"{self.place()},{{{ORIGIN}}}"

    @property
    def slip(self) -> str:
        """Slip velocity of the foot (mm/s): velocity of its lowest material point along the slope."""
        rolling = f"+{finite(self.radius)}*WZ({{{self.marker}}},{{{ORIGIN}}})" if self.radius else ""
        return f"VX({self.motion}){rolling}"

    @property
    def height(self) -> str:
        return f"DY({self.place()})-{finite(self.radius)}" if self.radius else f"DY({self.place()})"

    def restrict_to_pads(self, expression: str, elsewhere: str = "0") -> str:
        """Return an expression that equals `expression` on the pads of the foot's lane and `elsewhere` between them."""
        terrain = self.export.scene.ground.terrain
        if not terrain.has_pads:
            return expression
        pitch = MM * terrain.pitch
        lane = round(terrain.lanes[self.foot] / terrain.pitch)
        shift = MM * self.export.lane_shift_m(self.foot)
        along = f"(DX({self.place()}){-shift:+.17g})" if shift else f"DX({self.place()})"
        # The cosine is positive on the pads, because pads are one pitch long and their centres two pitches apart.
        wave = f"{'-' if lane % 2 else ''}COS(PI*{along}/{finite(pitch)})"
        return f"IF({wave}:{elsewhere},{elsewhere},{expression})"


def add_ground(model: AdamsModel, export: Exported) -> None:
    """Add the pads or floors as boxes, with one lane for each foot."""
    for number, pad in enumerate(export.pads):
        marker = f"{GROUND}.pad_{number + 1}"
        left = pad.centre_m - 0.5 * pad.length_m
        across = export.lane_across_m(pad.foot) - export.half_lane_m
        top = MM * (pad.height_m + export.model.balls[pad.foot].ground_m)
        model.markers[marker] = Marker(GROUND, (MM * left, top - PAD_MM, MM * across))
        size = MM * pad.length_m, PAD_MM, 2.0 * MM * export.half_lane_m
        model.shapes[f"pad_{number + 1}"] = Shape("BOX", marker, size)


def laws(export: Exported) -> tuple[Impact, Coulomb | None]:
    """Return the normal-force law and Coulomb friction in N, mm and s. Friction is None if there is none.

    Raises ConfigError for other laws.
    """
    normal = export.scene.ours.normal
    friction = export.scene.ours.friction
    if not isinstance(normal, Impact):
        raise ConfigError(
            f"The normal-force law {type(normal).__name__} cannot be exported.", "Set contact.normal_force=impact."
        )
    # Stiffness is in N/mm^e, so the factor depends on the exponent. ADAMS View scales it like force per length,
    # whatever the exponent is.
    k, e, c, full_damping_penetration = normal
    in_mm = Impact(k / MM**e, e, c / MM, MM * full_damping_penetration)
    if isinstance(friction, Frictionless):
        return in_mm, None
    if not isinstance(friction, Coulomb):
        raise ConfigError(
            f"The friction law {type(friction).__name__} cannot be exported.", "Set contact.friction=coulomb, or none."
        )
    return in_mm, friction.scale_creep(MM)


def add_contacts(model: AdamsModel, export: Exported) -> None:
    """Add an ADAMS contact between each ball and its pads."""
    normal, friction = laws(export)
    instead = "Export with --law functions, or set {}."
    if normal.exponent <= 1.0:
        raise ConfigError("ADAMS's contact needs an exponent above 1.", instead.format("contact.exponent=1.1"))
    if normal.damping <= 0.0:
        raise ConfigError("ADAMS's contact needs damping above 0.", instead.format("contact.damping=1"))
    if friction is not None and not 0.0 < friction.dynamic < friction.static:
        raise ConfigError(
            "ADAMS's contact needs static friction above dynamic friction, and both above 0.",
            instead.format(f"contact.dynamic_friction={finite(0.9 * friction.static)}"),
        )
    full = normal.full_damping_penetration
    law = {"stiffness": normal.stiffness, "damping": normal.damping, "dmax": full, "exponent": normal.exponent}
    sliding = {} if friction is None else dict(zip(FRICTION_NAMES, friction, strict=True))
    for foot in range(2):
        pads = tuple(f"pad_{number + 1}" for number, pad in enumerate(export.pads) if pad.foot == foot)
        model.contacts[f"contact_{foot + 1}"] = AdamsContact(f"ball_{foot + 1}", pads, law, sliding)


def add_normal_and_friction(model: AdamsModel, export: Exported) -> None:
    """Add slip and walkerlab's laws of normal force and friction for each foot, as functions of time and state."""
    if export.heights is not None:
        raise ConfigError(
            "Functions cannot describe uneven ground.", "Export with --law contact, or leave out the block ground."
        )
    normal, friction = laws(export)
    model.markers[BELOW] = Marker(GROUND, (0.0, -FREE_LENGTH_MM, 0.0))
    for number, leg in enumerate(LEGS):
        foot = FootTerms(export, number)
        place, length = (foot.place(), foot.radius) if foot.radius else (foot.place(BELOW), FREE_LENGTH_MM)
        numbers = ",".join(finite(value) for value in (length, *normal))
        model.variables[f"{leg}_slip"] = foot.slip
        model.variables[f"{leg}_normal"] = foot.restrict_to_pads(f"IMPACT(DY({place}),VY({foot.motion}),{numbers})")
        model.variables[f"{leg}_friction"] = "0" if friction is None else friction_function(leg, friction)


def friction_function(leg: str, law: Coulomb) -> str:
    """Return the expression for the friction force on a leg's foot, as a function of its slip and normal force."""
    slip = f"VARVAL({{{leg}_slip}})"
    normal = f"VARVAL({{{leg}_normal}})"
    mu, less, v, w = map(finite, law)
    # Beyond the stiction velocity, the first STEP stays at mu or -mu. The second one adds the fall to the dynamic
    # coefficient.
    rise = f"STEP({slip},-{v},-{mu},{v},{mu})"
    return f"-{normal}*({rise}+SIGN(1,{slip})*(STEP(ABS({slip}),{v},{mu},{w},{less})-{mu}))"


def add_push_offs(model: AdamsModel, export: Exported) -> None:
    """Add the push-off pulses on the trailing feet. They begin at the touchdown times of walkerlab's walk."""
    duration = export.config.push_off.duration_s
    if not any(export.impulses_N_s):
        return
    for number, leg in enumerate(LEGS):
        foot = FootTerms(export, number)
        # Leg 1 touches down first, so leg 2 is the first trailing leg.
        pulses = {f"{leg}_pulse_{pulse}": time for pulse, time in enumerate(export.touches_s[1 - number :: 2], 1)}
        for pulse, time in pulses.items():
            begin = finite(time)
            end = finite(time + duration)
            share = f"(TIME-{begin})*({end}-TIME)/{finite(duration**2)}"
            # The pulse has a unit impulse. A leg without push-off needs it as well, because its knee is held during the
            # pulse.
            model.variables[pulse] = f"IF(TIME-{begin}:0,0,IF({end}-TIME:0,0,{finite(30.0 / duration)}*({share})**2))"
        marker = f"{{{export.names[0]}.hinge}},{{{foot.marker}}},{{{ORIGIN}}}"
        up = f"DY({marker})+{finite(foot.radius)}" if foot.radius else f"DY({marker})"
        model.variables[f"{leg}_pulses"] = "+".join(f"VARVAL({{{pulse}}})" for pulse in pulses) or "0"
        model.variables[f"{leg}_line"] = f"SQRT(DX({marker})**2+({up})**2)"
        line = f"{finite(export.impulses_N_s[number])}*VARVAL({{{leg}_pulses}})/VARVAL({{{leg}_line}})"
        model.variables[f"{leg}_push_x"] = f"{line}*DX({marker})"
        model.variables[f"{leg}_push_y"] = f"{line}*({up})"


def add_forces(model: AdamsModel, export: Exported) -> None:
    """Add the ground and push-off forces on each foot."""
    for number, leg in enumerate(LEGS):
        foot = FootTerms(export, number)
        x, y = (
            [f"VARVAL({{{leg}_{kind}}})" for kind in kinds if f"{leg}_{kind}" in model.variables]
            for kinds in (("friction", "push_x"), ("normal", "push_y"))
        )
        if not x:
            continue
        reaction = f"{GROUND}.reaction_{number + 1}"
        model.markers[reaction] = Marker(GROUND, floating=True)
        along = "+".join(x)
        # The forces act at the ball's lowest point, so friction has the radius as its arm about the marker at the
        # centre.
        torque = f"{finite(foot.radius)}*({along})" if foot.radius else "0"
        model.forces[f"force_{number + 1}"] = Force(foot.marker, reaction, along, "+".join(y), torque)


def add_hip(model: AdamsModel, export: Exported) -> None:
    """Add the hip's spring, damper and torque. The torque changes sign at the touchdowns of walkerlab's walk."""
    hip = export.hip
    name = export.names[export.hip_link]
    i, j = f"{name}.hinge", model.joints[f"hinge_of_{name}"].j
    terms = []
    if hip.spring_N_m_per_rad:
        terms.append(f"-{finite(MM * hip.spring_N_m_per_rad)}*AZ({{{i}}},{{{j}}})")
    if hip.damping_N_m_s_per_rad:
        terms.append(f"-{finite(MM * hip.damping_N_m_s_per_rad)}*WZ({{{i}}},{{{j}}},{{{j}}})")
    if hip.torque_N_m:
        # Each factor changes its sign at one touchdown, so the product changes its sign at every touchdown.
        factors = [f"SIGN(1,{finite(time)}-TIME)" for time in export.touches_s]
        # ADAMS rejects most line breaks within an expression, so divide a long one into variables.
        groups = ["*".join(factors[k : k + 4]) for k in range(0, len(factors), 4)]
        for number, group in enumerate(groups):
            model.variables[f"leg_that_swings_{number + 1}"] = group
        signs = "".join(f"*VARVAL({{leg_that_swings_{number + 1}}})" for number in range(len(groups)))
        terms.append(f"{MM * hip.torque_N_m:+.17g}{signs}")
    if terms:
        model.torques["hip_torque"] = Torque(i, j, "".join(terms).removeprefix("+"))


def add_knees(model: AdamsModel, export: Exported) -> None:
    """Add stops and locks of the knees, and the events of walkerlab's walk that switch them.

    An ADAMS function has no memory, and a command file has no branches. So the run waits for one sensor after another,
    in the order of walkerlab's walk. Other sensors halt it if the walker falls or comes down on a bent knee.
    """
    law = knee_rules(export.config.walker).stop
    assert isinstance(law, Impact), "the export has a compliant stop"
    # IMPACT acts if its argument is below the free length. With a free length of 1 rad and the argument 1 - angle, it
    # acts when the knee is beyond straight.
    stop = ",".join(finite(value) for value in (1.0, MM * law.stiffness, *law[1:2], MM * law.damping, law[3]))
    for number, leg in enumerate(LEGS):
        foot = FootTerms(export, number)
        other = LEGS[1 - number]
        place = f"{{{foot.marker}}},{{{FootTerms(export, 1 - number).marker}}},{{{ORIGIN}}}"
        # Between the pads, where there is no ground, the sensor must not reach zero.
        down = foot.restrict_to_pads(f"-({foot.height})", elsewhere="-1")
        down_ahead = Sensor(f"IF(DX({place}):-1,-1,{down})", ERROR_MM)
        sinking = f"VY({foot.motion})"
        if f"{other}_pulses" in model.variables:
            # The value -1 keeps the trailing knee locked during the push-off.
            sinking = f"IF(-VARVAL({{{other}_pulses}}):-1,{sinking},{sinking})"
        model.sensors |= {f"{leg}_sinks_no_longer": Sensor(sinking, ERROR_MM), f"{leg}_touches": down_ahead}
        if number >= len(export.knee_links):
            continue
        shank = export.names[export.knee_links[number]]
        i, j = f"{shank}.hinge", model.joints[f"hinge_of_{shank}"].j
        angle = f"AZ({{{i}}},{{{j}}})"
        rate = f"WZ({{{i}}},{{{j}}},{{{j}}})"
        model.torques[f"stop_{number + 1}"] = Torque(i, j, f"-IMPACT(1-{angle},-{rate},{stop})")
        model.motions[f"lock_{number + 1}"] = f"hinge_of_{shank}"
        if damping := knee_dampings(export.config.walker)[number]:
            model.torques[f"knee_damper_{number + 1}"] = Torque(i, j, f"-{finite(MM * damping)}*{rate}")
        model.sensors |= {
            f"{leg}_bent": Sensor(f"-{finite(MIN_FLEXION)}-{angle}", ERROR_RAD),
            f"{leg}_straight": Sensor(f"IF({angle}:-1,-1,-{rate})", ERROR_RAD),
            f"{leg}_touches": Sensor(down, ERROR_MM),
            f"{leg}_on_bent_knee": replace(down_ahead, halts=True),
        }
    lowest = FALLEN_HIP * MM * export.config.walker.leg_length_m
    model.sensors["fell"] = Sensor(f"{finite(lowest)}-DY({{{export.names[0]}.hinge}})", ERROR_MM, halts=True)
    # Leg 1 swings first, so only the lock of leg 2 is active at the start.
    stops = [stop for stop in ("stop_1", "stop_2") if stop in model.torques]
    model.inactive = (*stops, "lock_1", *(name for name in model.sensors if name != "fell"))
    for step in range(export.walk.steps):
        model.events += step_events(export, step % 2)


def step_events(export: Exported, swing: int) -> Iterator[Event]:
    """Yield the events of a step in which a leg swings: its knee bends and locks, its foot lands and sinks in."""
    leg = LEGS[swing]
    number = swing + 1
    trailing = 2 - swing
    on_bent_knee = f"{leg}_on_bent_knee"
    if number <= len(export.knee_links):
        yield Event(f"{leg}_bent", (f"stop_{number}", on_bent_knee))
        yield Event(f"{leg}_straight", (f"lock_{number}",), (f"stop_{number}", on_bent_knee))
    if trailing > len(export.knee_links):
        yield Event(f"{leg}_touches")
        return
    released = (f"lock_{trailing}",)
    if knee_rules(export.config.walker).release_at_touch and not any(export.impulses_N_s):
        yield Event(f"{leg}_touches", (), released)
    else:
        yield Event(f"{leg}_touches")
        yield Event(f"{leg}_sinks_no_longer", (), released)


def add_requests(model: AdamsModel, export: Exported, law: str) -> None:
    """Add requests named after the quantities of a walk. Angles are from the vertical, lengths in mm."""
    # ADAMS measures angles from the slope's normal.
    tilt = f"{-export.scene.ours.slope:+.17g}" if export.scene.ours.slope else ""
    for foot, (leg, part) in enumerate(zip(LEGS, (export.names[export.hip_link], export.names[0]), strict=True)):
        terms = FootTerms(export, foot)
        # Components 2 and 3 of CONTACT are the forces along x and y.
        ground = ("3", "2") if law == "contact" else ("normal", "friction")
        normal, friction = (
            f"CONTACT({{contact_{foot + 1}}},0,{part_of},0)" if law == "contact" else f"VARVAL({{{leg}_{part_of}}})"
            for part_of in ground
        )
        model.requests[leg] = {
            "angle": f"AZ({{{part}.hinge}},{{{ORIGIN}}}){tilt}",
            "velocity": f"WZ({{{part}.hinge}},{{{ORIGIN}}})",
            "foot_along": f"DX({terms.place()})",
            "foot_height": terms.height,
            "normal_force": normal,
            "friction_force": friction,
            "penetration": terms.restrict_to_pads(f"MAX(0,-({terms.height}))"),
            "slip_velocity": terms.slip,
        }
    hip = f"{{{export.names[0]}.hinge}}"
    walker = {"hip_along": f"DX({hip})", "hip_height": f"DY({hip})"}
    if TORSO in model.parts:
        walker["torso_angle"] = f"AZ({{{TORSO}.hinge}},{{{ORIGIN}}}){tilt}"
        walker["torso_velocity"] = f"WZ({{{TORSO}.hinge}},{{{ORIGIN}}})"
    model.requests["walker"] = walker
