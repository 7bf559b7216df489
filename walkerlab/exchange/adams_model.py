"""Walker as ADAMS objects (parts, markers, joints, forces, requests), in N, mm, kg and s.

The walk takes place in the x-y plane, x along the slope and y normal to it; gravity is tilted.
Expressions name markers and variables in braces, as in DX({leg_1.foot}); each file format inserts its own names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from walkerlab.errors import ConfigError
from walkerlab.exchange.exported import Exported, finite
from walkerlab.physics.ground.friction import Coulomb, Frictionless
from walkerlab.physics.ground.normal_force import NormalLaw
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.mechanics.walkers import TORSO

MM = 1000.0
GROUND, ORIGIN, BELOW = "ground", "ground.origin", "ground.below"
FREE_LENGTH_MM = 100.0
"""Free length in IMPACT for a point foot: the foot's height is measured from a marker this far below the ground."""
PAD_MM = 50.0
"""Thickness of the pads."""
LEGS = ("leg_1", "leg_2")
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Marker:
    """Point of a part, in the part's frame (mm); a floating marker follows the point at which a reaction acts."""

    part: str
    place: Place = (0.0, 0.0, 0.0)
    floating: bool = False


@dataclass(frozen=True)
class Part:
    """Rigid body: position (mm), angle (rad), velocity (mm/s), spin (rad/s), mass (kg) and inertia (kg mm^2)."""

    place: tuple[float, float]
    angle: float
    velocity: tuple[float, float]  # velocity of the centre of mass
    spin: float
    mass: float
    centre: str  # marker at the centre of mass
    inertia: float


@dataclass(frozen=True)
class Joint:
    """Constraint between two markers: PLANAR, REVOLUTE, or the primitive INLINE."""

    kind: str
    i: str
    j: str


@dataclass(frozen=True)
class Shape:
    """Ellipsoid centred on a marker, or box with a corner there; `size` holds its diameters or edge lengths (mm)."""

    kind: str
    marker: str
    size: Place


@dataclass(frozen=True)
class AdamsContact:
    """ADAMS contact between a foot and its pads."""

    foot: str
    pads: tuple[str, ...]
    normal: NormalLaw  # stiffness in N/mm^e, damping in N s/mm, penetration in mm
    friction: Coulomb | None  # velocities in mm/s; None if there is no friction


@dataclass(frozen=True)
class Force:
    """In-plane force (N) and torque (N mm) on a marker, as expressions; the ground takes the reaction."""

    i: str
    reaction: str
    x: str
    y: str
    torque: str


@dataclass(frozen=True)
class Torque:
    """Torque (N mm) on the part of marker `i`; its reaction acts on the part of marker `j`."""

    i: str
    j: str
    function: str


@dataclass
class AdamsModel:
    """All objects of a model by name, in the order in which they are written."""

    name: str
    gravity: tuple[float, float]  # mm/s^2
    parts: dict[str, Part] = field(default_factory=dict)
    markers: dict[str, Marker] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    couplers: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    shapes: dict[str, Shape] = field(default_factory=dict)
    outlines: dict[str, tuple[str, ...]] = field(default_factory=dict)
    contacts: dict[str, AdamsContact] = field(default_factory=dict)
    variables: dict[str, str] = field(default_factory=dict)
    forces: dict[str, Force] = field(default_factory=dict)
    torques: dict[str, Torque] = field(default_factory=dict)
    requests: dict[str, dict[str, str]] = field(default_factory=dict)

    def shape_name(self, shape: str) -> str:
        """Prefix a shape's name with the name of its part."""
        return f"{self.markers[self.shapes[shape].marker].part}.{shape}"


def adams_model(export: Exported, law: str) -> AdamsModel:
    """Build the ADAMS model of an export, with ADAMS contact (law `contact`) or walkerlab's law (`functions`).

    Raises ConfigError for a contact law, ground or coupling that cannot be expressed.
    """
    planar = export.model
    gravity = MM * planar.gravity_along, -MM * planar.gravity_down
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
    add_requests(model, export, law)
    return model


def add_bodies(model: AdamsModel, export: Exported) -> None:
    """Add parts, markers, hinges, feet and couplers; a planar joint keeps the base in the plane of the walk."""
    planar, names = export.model, export.names
    q, v = export.start
    places: list[tuple[float, float]] = []  # origins of the links' frames (m)
    angles: list[float] = []
    spins: list[float] = []
    motions: list[tuple[float, float]] = []
    for k, (name, link) in enumerate(zip(names, planar.links, strict=True)):
        spin = float(v[2 + k])
        if link.parent < 0:
            angle, hinge, motion = float(q[2]), (float(q[0]), float(q[1])), (float(v[0]), float(v[1]))
        else:
            up = link.parent
            angle, spin = angles[up] + float(q[2 + k]), spins[up] + spin
            hinge, motion = carried(places[up], angles[up], motions[up], spins[up], link.parent_point_m)
        back = (-link.point_m[0], -link.point_m[1])
        place, motion = carried(hinge, angle, motion, spin, back)
        places.append(place)
        angles.append(angle)
        spins.append(spin)
        motions.append(motion)
        _, centre_motion = carried(place, angle, motion, spin, link.centre_m)
        markers = {"cm": link.centre_m, "hinge": link.point_m}
        model.markers |= {f"{name}.{point}": Marker(name, (MM * x, MM * y, 0.0)) for point, (x, y) in markers.items()}
        centre, inertia = f"{name}.cm", link.inertia_kg_m2 * MM**2
        velocity = MM * centre_motion[0], MM * centre_motion[1]
        model.parts[name] = Part((MM * place[0], MM * place[1]), angle, velocity, spin, link.mass_kg, centre, inertia)
        if link.parent < 0:
            model.joints["plane_of_walk"] = Joint("PLANAR", f"{name}.hinge", ORIGIN)
        else:
            on_parent = f"{names[link.parent]}.hinge_of_{name}"
            x, y = link.parent_point_m
            model.markers[on_parent] = Marker(names[link.parent], (MM * x, MM * y, 0.0))
            model.joints[f"hinge_of_{name}"] = Joint("REVOLUTE", f"{name}.hinge", on_parent)
    for number, coupling in enumerate(export.couplings):
        weights = zip((f"hinge_of_{names[link]}" for link in coupling.links), coupling.weights, strict=True)
        model.couplers[f"coupler_{number + 1}"] = tuple(weights)
    for foot, ball in enumerate(planar.balls):
        # parts turn only about the normal of the plane, so a ball stays at its distance from the plane, in its lane
        x, y = ball.centre_m
        name = names[ball.link]
        model.markers[f"{name}.foot"] = Marker(name, (MM * x, MM * y, 0.0))
        lane = f"{name}.ball"
        model.markers[lane] = Marker(name, (MM * x, MM * y, MM * export.lane_across_m(foot)))
        diameter = 2.0 * MM * ball.radius_m
        model.shapes[f"ball_{foot + 1}"] = Shape("ELLIPSOID", lane, (diameter, diameter, diameter))
        model.outlines[f"line_{foot + 1}"] = (f"{name}.hinge", f"{name}.foot")
    if export.pinned:
        held = foot_marker(export, STANCE_FOOT)
        part, (x, y, _) = model.parts[part_of_foot(export, STANCE_FOOT)], model.markers[held].place
        place, _ = carried(part.place, part.angle, (0.0, 0.0), 0.0, (x, y))
        model.markers[f"{GROUND}.pin"] = Marker(GROUND, (*place, 0.0))
        model.joints["pin"] = Joint("INLINE", held, f"{GROUND}.pin")


def carried(
    place: tuple[float, float], angle: float, motion: tuple[float, float], spin: float, point: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return position and velocity of a point of a body; `place` and `motion` are those of the body's origin."""
    s, c = math.sin(angle), math.cos(angle)
    x, y = c * point[0] - s * point[1], s * point[0] + c * point[1]
    return (place[0] + x, place[1] + y), (motion[0] - spin * y, motion[1] + spin * x)


@dataclass(frozen=True)
class FootTerms:
    """ADAMS expressions for the motion of a foot relative to the ground."""

    export: Exported
    foot: int

    @property
    def marker(self) -> str:
        return foot_marker(self.export, self.foot)

    @property
    def radius(self) -> float:
        """Radius of the foot (mm)."""
        return MM * float(self.export.scene.ours.whole.radius[self.foot])

    def place_over(self, base: str) -> str:
        """Arguments for functions that measure the foot's position relative to the marker `base`."""
        return f"{{{self.marker}}},{{{base}}},{{{ORIGIN}}}"

    @property
    def place(self) -> str:
        """Arguments for functions that measure the foot's position relative to the ground's origin."""
        return self.place_over(ORIGIN)

    @property
    def motion(self) -> str:
        """Arguments for functions that measure the foot's velocity relative to the ground."""
        return f"{self.place},{{{ORIGIN}}}"

    @property
    def slip(self) -> str:
        """Slip velocity (mm/s), along the slope, of the material at the foot's lowest point."""
        rolling = f"+{finite(self.radius)}*WZ({{{self.marker}}},{{{ORIGIN}}})" if self.radius else ""
        return f"VX({self.motion}){rolling}"

    @property
    def height(self) -> str:
        return f"DY({self.place})-{finite(self.radius)}" if self.radius else f"DY({self.place})"

    def where_carried(self, expression: str) -> str:
        """Restrict an expression to the pads of the foot's lane; it is zero over the gaps between them."""
        terrain = self.export.scene.ground.terrain
        if not terrain.has_pads:
            return expression
        pitch, lane = MM * terrain.pitch, round(terrain.lanes[self.foot] / terrain.pitch)
        return f"IF({'-' if lane % 2 else ''}COS(PI*DX({self.place})/{finite(pitch)}):0,0,{expression})"


def part_of_foot(export: Exported, foot: int) -> str:
    return export.names[export.model.balls[foot].link]


def foot_marker(export: Exported, foot: int) -> str:
    return f"{part_of_foot(export, foot)}.foot"


def add_ground(model: AdamsModel, export: Exported) -> None:
    """Add the pads or floors as boxes, with one lane for each foot."""
    for number, pad in enumerate(export.pads):
        marker = f"{GROUND}.pad_{number + 1}"
        left, ball = pad.centre_m - 0.5 * pad.length_m, export.model.balls[pad.foot]
        across = export.lane_across_m(pad.foot) - export.half_lane_m
        top = MM * (pad.height_m + ball.ground_m)
        model.markers[marker] = Marker(GROUND, (MM * left, top - PAD_MM, MM * across))
        size = MM * pad.length_m, PAD_MM, 2.0 * MM * export.half_lane_m
        model.shapes[f"pad_{number + 1}"] = Shape("BOX", marker, size)


def laws(export: Exported) -> tuple[NormalLaw, Coulomb | None]:
    """Return normal-force law and Coulomb friction (None: no friction) in N, mm, s; ConfigError for other friction."""
    normal, friction = export.scene.ours.normal, export.scene.ours.friction
    in_mm = NormalLaw(
        normal.stiffness / MM**normal.exponent,
        normal.exponent,
        normal.damping / MM,
        MM * normal.full_damping_penetration,
    )
    if isinstance(friction, Frictionless):
        return in_mm, None
    if not isinstance(friction, Coulomb):
        raise ConfigError(
            f"The friction law {type(friction).__name__} cannot be exported.", "Set contact.friction=coulomb, or none."
        )
    return in_mm, friction.with_creep(MM)


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
    for foot in range(2):
        pads = tuple(f"pad_{number + 1}" for number, pad in enumerate(export.pads) if pad.foot == foot)
        model.contacts[f"contact_{foot + 1}"] = AdamsContact(f"ball_{foot + 1}", pads, normal, friction)


def add_normal_and_friction(model: AdamsModel, export: Exported) -> None:
    """Add walkerlab's law as functions of time and state: slip, normal force and friction of each foot."""
    if export.heights is not None:
        raise ConfigError(
            "Uneven ground cannot be written as functions.", "Export with --law contact, or leave out the block ground."
        )
    normal, friction = laws(export)
    model.markers[BELOW] = Marker(GROUND, (0.0, -FREE_LENGTH_MM, 0.0))
    for number, leg in enumerate(LEGS):
        foot = FootTerms(export, number)
        place = (foot.place, foot.radius) if foot.radius else (foot.place_over(BELOW), FREE_LENGTH_MM)
        numbers = ",".join(finite(value) for value in (place[1], *normal))
        model.variables[f"{leg}_slip"] = foot.slip
        model.variables[f"{leg}_normal"] = foot.where_carried(f"IMPACT(DY({place[0]}),VY({foot.motion}),{numbers})")
        model.variables[f"{leg}_friction"] = "0" if friction is None else friction_function(leg, friction)


def friction_function(leg: str, law: Coulomb) -> str:
    """Return the expression for the friction force on a leg's foot, a function of the foot's slip and normal force."""
    slip, normal = f"VARVAL({{{leg}_slip}})", f"VARVAL({{{leg}_normal}})"
    mu, less, v, w = (
        finite(value) for value in (law.static, law.dynamic, law.stiction_velocity, law.friction_velocity)
    )
    rise = f"STEP({slip},-{v},-{mu},{v},{mu})"
    return f"-{normal}*({rise}+SIGN(1,{slip})*(STEP(ABS({slip}),{v},{mu},{w},{less})-{mu}))"


def add_push_offs(model: AdamsModel, export: Exported) -> None:
    """Add the push-off pulses on the trailing feet; they begin at the touchdown times of walkerlab's walk."""
    impulse, duration = export.config.push_off.impulse_N_s, export.config.push_off.duration_s
    if impulse == 0.0:
        return
    hip = f"{part_of_base(export)}.hinge"
    for foot, leg in enumerate(LEGS):
        # leg_1 touches down first, so leg_2 is the first to trail
        times = export.touches_s[1 - foot :: 2]
        pulses = []
        for number, time in enumerate(times):
            begin, end = finite(time), finite(time + duration)
            share = f"(TIME-{begin})*({end}-TIME)/{finite(duration**2)}"
            pulse = f"{leg}_pulse_{number + 1}"
            force = finite(30.0 * impulse / duration)
            model.variables[pulse] = f"IF(TIME-{begin}:0,0,IF({end}-TIME:0,0,{force}*({share})**2))"
            pulses.append(f"VARVAL({{{pulse}}})")
        marker = f"{{{hip}}},{{{foot_marker(export, foot)}}},{{{ORIGIN}}}"
        radius = float(export.scene.ours.whole.radius[foot])
        up = f"DY({marker})+{finite(MM * radius)}" if radius else f"DY({marker})"
        model.variables[f"{leg}_pulses"] = "+".join(pulses) or "0"
        model.variables[f"{leg}_line"] = f"SQRT(DX({marker})**2+({up})**2)"
        line = f"VARVAL({{{leg}_pulses}})/VARVAL({{{leg}_line}})"
        model.variables[f"{leg}_push_x"] = f"{line}*DX({marker})"
        model.variables[f"{leg}_push_y"] = f"{line}*({up})"


def part_of_base(export: Exported) -> str:
    """Return the part at the root of the tree: the first stance leg, whose hinge is at the hip."""
    return export.names[0]


def add_forces(model: AdamsModel, export: Exported) -> None:
    """Add the ground and push-off forces on each foot."""
    for foot, leg in enumerate(LEGS):
        x, y = (
            [f"VARVAL({{{leg}_{kind}}})" for kind in kinds if f"{leg}_{kind}" in model.variables]
            for kinds in (("friction", "push_x"), ("normal", "push_y"))
        )
        if not x:
            continue
        radius = MM * float(export.scene.ours.whole.radius[foot])
        reaction = f"{GROUND}.reaction_{foot + 1}"
        model.markers[reaction] = Marker(GROUND, floating=True)
        along = "+".join(x)
        torque = f"{finite(radius)}*({along})" if radius else "0"
        model.forces[f"force_{foot + 1}"] = Force(foot_marker(export, foot), reaction, along, "+".join(y), torque)


def add_hip(model: AdamsModel, export: Exported) -> None:
    """Add the hip's spring, damper and torque; the torque changes sign at the touchdowns of walkerlab's walk."""
    hip, name = export.hip, export.names[export.hip_link]
    i, j = f"{name}.hinge", model.joints[f"hinge_of_{name}"].j
    terms = []
    if hip.spring_N_m_per_rad:
        terms.append(f"-{finite(MM * hip.spring_N_m_per_rad)}*AZ({{{i}}},{{{j}}})")
    if hip.damping_N_m_s_per_rad:
        terms.append(f"-{finite(MM * hip.damping_N_m_s_per_rad)}*WZ({{{i}}},{{{j}}},{{{j}}})")
    if hip.torque_N_m:
        factors = [f"SIGN(1,{finite(time)}-TIME)" for time in export.touches_s]
        groups = ["*".join(factors[k : k + 4]) for k in range(0, len(factors), 4)]
        for number, group in enumerate(groups):
            model.variables[f"leg_that_swings_{number + 1}"] = group
        signs = "".join(f"*VARVAL({{leg_that_swings_{number + 1}}})" for number in range(len(groups)))
        terms.append(f"{MM * hip.torque_N_m:+.17g}{signs}")
    if terms:
        model.torques["hip_torque"] = Torque(i, j, "".join(terms).removeprefix("+"))


def add_requests(model: AdamsModel, export: Exported, law: str) -> None:
    """Add requests named after the quantities of a walk; angles are from the vertical, lengths in mm."""
    tilt = f"{-export.scene.ours.slope:+.17g}" if export.scene.ours.slope else ""
    uppers = export.names[export.hip_link], export.names[0]
    for foot, (leg, part) in enumerate(zip(LEGS, uppers, strict=True)):
        terms = FootTerms(export, foot)
        ground = ("3", "2") if law == "contact" else ("normal", "friction")
        normal, friction = (
            f"CONTACT({{contact_{foot + 1}}},0,{part_of},0)" if law == "contact" else f"VARVAL({{{leg}_{part_of}}})"
            for part_of in ground
        )
        model.requests[leg] = {
            "angle": f"AZ({{{part}.hinge}},{{{ORIGIN}}}){tilt}",
            "velocity": f"WZ({{{part}.hinge}},{{{ORIGIN}}})",
            "foot_along": f"DX({terms.place})",
            "foot_height": terms.height,
            "normal_force": normal,
            "friction_force": friction,
            "penetration": terms.where_carried(f"MAX(0,-({terms.height}))"),
            "slip_velocity": terms.slip,
        }
    hip = f"{{{part_of_base(export)}.hinge}}"
    walker = {"hip_along": f"DX({hip})", "hip_height": f"DY({hip})"}
    if TORSO in model.parts:
        walker["torso_angle"] = f"AZ({{{TORSO}.hinge}},{{{ORIGIN}}}){tilt}"
        walker["torso_velocity"] = f"WZ({{{TORSO}.hinge}},{{{ORIGIN}}})"
    model.requests["walker"] = walker
