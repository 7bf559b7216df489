"""Momentum and energy of walkers computed from their point masses, independently of the equations of motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from walkerlab.evidence.verification.verdict import finite
from walkerlab.physics.mechanics.assembly import Anchor, levers, masses
from walkerlab.physics.mechanics.parts import Assembly
from walkerlab.physics.mechanics.rigid import find_hip, group_bodies, have_equal_legs
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING
from walkerlab.physics.solvers.system import Floats


class Masses:
    """Point masses of a walker, with levers from a reference point (default: its centre of mass).

    mass     (masses,) kg
    levers   (masses, bodies, 2) m, from the reference point to each mass
    inertia  (bodies,) kg m^2, of each body about its own centre of mass
    """

    def __init__(self, assembly: Assembly, about: Anchor | None = None) -> None:
        point_masses = list(masses(assembly))
        root = about or point_masses[0][1]
        self.mass = np.array([mass for mass, _ in point_masses])
        self.levers = np.array([levers(assembly, root, anchor) for _, anchor in point_masses])
        if about is None:
            self.levers = self.levers - np.average(self.levers, axis=0, weights=self.mass)
        self.inertia = np.array([body.inertia_kg_m2 for body in assembly.bodies])

    def moving(self, psi: Floats, rate: Floats) -> tuple[Floats, Floats]:
        """Return positions and velocities (..., masses, 2) from the reference point. `psi` and `rate` are (...,
        bodies).
        """
        arms = rotate(self.levers, psi[..., None, :])
        swept = np.stack([-arms[..., 1], arms[..., 0]], axis=-1) * rate[..., None, :, None]
        return arms.sum(axis=-2), swept.sum(axis=-2)


def rotate(d: Floats, psi: Floats) -> Floats:
    """Rotate levers (..., bodies, 2) by the angles of their bodies (..., bodies)."""
    s, c = np.sin(psi), np.cos(psi)
    return np.stack([c * d[..., 0] - s * d[..., 1], s * d[..., 0] + c * d[..., 1]], axis=-1)


@dataclass(frozen=True)
class Moving:
    """Motion of a walker's masses and bodies at an instant. The origin is on the ground under the stance foot."""

    mass: Floats  # (masses,) kg
    place: Floats  # (masses, 2) m
    velocity: Floats  # (masses, 2) m/s
    inertia: Floats  # (bodies,) kg m^2, about the bodies' own centres of mass
    rate: Floats  # (bodies,) rad/s
    hip: Floats  # (2,) m
    contact: Floats  # (2,) m, lowest point of the swing foot

    @property
    def kinetic(self) -> float:
        """Kinetic energy (J)."""
        return float(0.5 * self.mass @ (self.velocity**2).sum(axis=1) + 0.5 * self.inertia @ self.rate**2)

    def momentum_about(self, point: Floats, on_masses: Floats, on_bodies: Floats) -> float:
        """Return the angular momentum (kg m^2/s) about a point. `on_masses` and `on_bodies` are the weights of their
        terms.
        """
        arm = self.place - point
        orbital = self.mass * (arm[:, 0] * self.velocity[:, 1] - arm[:, 1] * self.velocity[:, 0])
        return float(on_masses @ orbital + on_bodies @ (self.inertia * self.rate))


class SwingMasses:
    """Momenta and energy of a walker in the rigid model while its first leg swings, computed from its point masses."""

    def __init__(self, assembly: Assembly, slope: float) -> None:
        """Measure levers from the centre of the stance foot's arc. The slope is in rad."""
        foot = assembly.feet[STANCE]
        trailing = assembly.feet[SWING]
        hip = find_hip(assembly)
        root = Anchor(foot.body, foot.centre_m)
        self.assembly = assembly
        self.slope = slope
        self.radius = foot.radius_m
        self.raised = np.array([0.0, foot.radius_m - trailing.radius_m])
        self.members = group_bodies(assembly).members
        self.masses = Masses(assembly, root)
        self.owner = [assembly.index(anchor.body) for _, anchor in masses(assembly)]
        self.to_hip = levers(assembly, root, Anchor(hip.parent, hip.parent_point_m))
        self.to_foot = levers(assembly, root, Anchor(trailing.body, trailing.centre_m))
        self.shares = {leg: self.share_of(leg) for leg in (STANCE, SWING)}

    def pose(self, state: Floats) -> Moving:
        """Return the masses with their positions and velocities in a state of the rigid model (2 n,)."""
        n = self.members.shape[1]
        psi = self.members @ state[:n] + self.slope
        rate = self.members @ state[n:]
        centre = np.array([0.0, self.radius])
        rolling = np.array([-self.radius * state[n + STANCE], 0.0])
        place, velocity = self.masses.moving(psi, rate)
        hip = centre + rotate(self.to_hip, psi).sum(axis=0)
        contact = rotate(self.to_foot, psi).sum(axis=0) + self.raised
        mass = self.masses.mass
        inertia = self.masses.inertia
        return Moving(mass, centre + place, rolling + velocity, inertia, rate, hip, contact)

    def share_of(self, leg: int) -> Floats:
        """Return the share (bodies,) of each body that belongs to a leg. Coupled bodies belong to it in part."""
        names = [body.name for body in self.assembly.bodies]
        of_leg = self.assembly.legs[leg]
        share = np.array([1.0 if name in of_leg else 0.0 for name in names])
        for coupling in self.assembly.couplings:
            turning = (weight for name, weight in zip(coupling.of, coupling.weights, strict=True) if name in of_leg)
            share[names.index(coupling.body)] = sum(turning)
        return share

    def momenta(self, moving: Moving, new: bool) -> tuple[float, float]:
        """Return the two angular momenta that a heel strike conserves (kg m^2/s).

        The first is the walker's about the new foothold; the second is the lifting leg's about the hip, including the
        leg's share of coupled bodies.

        new  whether the pose is after heel strike, with the roles of the legs exchanged
        """
        share = self.shares[SWING if new else STANCE]
        foothold = np.zeros(2) if new else moving.contact
        walker_momentum = moving.momentum_about(foothold, np.ones(len(self.owner)), np.ones(share.size))
        return walker_momentum, moving.momentum_about(moving.hip, share[self.owner], share)


class RigidMasses:
    """Heel strikes of a walk computed from its point masses: those of both legs, which swing in turn."""

    def __init__(self, assembly: Assembly, slope: float) -> None:
        exchanged = replace(assembly, legs=assembly.legs[::-1], feet=assembly.feet[::-1])
        own = SwingMasses(assembly, slope)
        self.turns = (own, own if have_equal_legs(assembly) else SwingMasses(exchanged, slope))

    def poses(self, states: Floats, first: int = 0) -> list[Moving]:
        """Return the masses in each of the states (strikes, 2 n). In the first of them leg `first` (0 or 1) swings."""
        return [self.turns[(first + k) % 2].pose(state) for k, state in enumerate(states)]

    def momentum_change(
        self, before: Sequence[Moving], after: Sequence[Moving], push_offs: tuple[float, float] = (0.0, 0.0)
    ) -> float:
        """Return the largest relative change of the conserved momenta over heel strikes.

        push_offs  N s, of each leg
        """
        change = 0.0
        size = 1e-300
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            at_start = np.array(self.turns[k % 2].momenta(old, new=False))
            at_end = np.array(self.turns[(k + 1) % 2].momenta(new, new=True))
            at_start[0] += moment_of(push_offs[(k + 1) % 2], old)
            change = max(change, *np.abs(at_end - at_start))
            size = max(size, *np.abs(at_start), *np.abs(at_end))
        return finite(change / size)


def moment_of(push_off: float, moving: Moving) -> float:
    """Return the angular impulse (kg m^2/s) of a push-off (N s, from rear foot to hip) about the new foothold."""
    along, up = push_off * moving.hip / np.hypot(*moving.hip)
    return float(moving.contact[1] * along - moving.contact[0] * up)


def energy_won(before: Sequence[Moving], after: Sequence[Moving]) -> float:
    """Return the largest gain of kinetic energy (J) in a heel strike, or 0 if all of them lose energy."""
    return max(0.0, *(new.kinetic - old.kinetic for old, new in zip(before, after, strict=True)))


def feet_off_the_slope(before: Sequence[Moving]) -> float:
    """Return the largest distance (m) of a landing foot from the slope at heel strike."""
    return float(max(abs(moving.contact[1]) for moving in before))
