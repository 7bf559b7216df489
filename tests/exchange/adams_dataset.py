"""Read ADAMS/Solver datasets (.adm). This small reader is written from the description of the format alone.

It rebuilds parts, markers, joints and force expressions of planar models (motion in the x-y plane of the ground),
evaluates the expressions as they are written, and integrates with SciPy. Every part has three coordinates (x, y of
its frame's origin and its angle); joints are constraints on them, which acceleration multipliers enforce.
"""

from __future__ import annotations

import ast
import math
import re
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?D?$")
EXPRESSIONS = {"FUNCTION", "FX", "FY", "FZ", "TX", "TY", "TZ", *(f"F{n}" for n in range(1, 9))}
MEASURES = {"DX", "DY", "DZ", "VX", "VY", "VZ", "WX", "WY", "WZ", "AX", "AY", "AZ", "VARVAL"}
LENGTHS_M = {"METER": 1.0, "MILLIMETER": 1e-3, "CENTIMETER": 1e-2, "INCH": 0.0254}


@dataclass(frozen=True)
class Statement:
    """Statement of a dataset: name, id, flags, and arguments by name."""

    name: str
    id: int
    flags: tuple[str, ...]
    arguments: dict[str, str]
    label: str = ""

    def numbers(self, key: str, default: tuple[float, ...] = ()) -> tuple[float, ...]:
        return tuple(number(text) for text in self.arguments[key].split(",")) if key in self.arguments else default

    def marker(self, key: str) -> int:
        return int(self.arguments[key])


def number(text: str) -> float:
    """Parse a number as ADAMS writes it. A trailing D means degrees, which become radians."""
    text = text.strip()
    assert NUMBER.match(text), f"not a number: {text!r}"
    return math.radians(float(text[:-1])) if text.endswith("D") else float(text)


def logical_lines(text: str):
    """Yield each statement as a single line, with the name that Adams View gives to the object."""
    title, *lines = text.splitlines()
    assert "/" not in title, "the first line is a title and must not look like a statement"
    label, current = "", None
    for line in lines:
        assert len(line) <= 2000
        if line.lstrip().startswith("!"):
            if named := re.search(r"adams_view_name='(\w+)'", line):
                label = named[1]
                assert not label[0].isdigit()
            continue
        line = line.split("!")[0].rstrip()
        if not line:
            continue
        if line.startswith(","):
            assert current is not None
            current[0] += line
        else:
            if current:
                yield tuple(current)
            current, label = [line, label], ""
    if current:
        yield tuple(current)


def split_arguments(text: str) -> list[str]:
    """Split at commas outside parentheses and quotes. An expression ends at a backslash or at the end of the text."""
    pieces, depth, quoted, start = [], 0, False, 0
    for i, character in enumerate(text):
        if character == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif character == "(":
            depth += 1
        elif character == ")":
            depth -= 1
            assert depth >= 0
        elif (character == "," and depth == 0) or (character == "\\" and text[i + 1 : i + 2] not in (",", "")):
            pieces.append(text[start : i + (character == "\\")])
            start = i + 1
    assert depth == 0
    assert not quoted
    return [*pieces, text[start:]]


def parse_statement(line: str, label: str) -> Statement:
    head, *pieces = split_arguments(line)
    name, _, identity = head.partition("/")
    flags, arguments, key = [], {}, None
    for piece in pieces:
        text = piece.strip()
        if "=" in text:
            key, _, value = (part.strip() for part in text.partition("="))
            key = key.upper()
            if arguments and (last := next(reversed(arguments))) in EXPRESSIONS:
                assert arguments[last].endswith("\\"), f"{head}: {last} is neither last nor closed by a backslash"
            assert key not in arguments, f"{head}: {key} twice"
            arguments[key] = value
        elif key is not None and key not in EXPRESSIONS and text and (NUMBER.match(text) or text.startswith('"')):
            arguments[key] += "," + text
        elif text:
            flags.append(text.upper())
            key = None
    arguments = {key: value.rstrip("\\").strip() if key in EXPRESSIONS else value for key, value in arguments.items()}
    identity = identity.strip()
    return Statement(name.strip().upper(), int(identity) if identity else 0, tuple(flags), arguments, label)


def read_statements(text: str) -> list[Statement]:
    statements = [parse_statement(*line) for line in logical_lines(text)]
    assert statements[-1].name == "END"
    seen = [(statement.name, statement.id) for statement in statements]
    assert len(set(seen)) == len(seen), "ids are unique within a type of statement"
    return statements[:-1]


@dataclass(frozen=True)
class Marker:
    part: int
    place: np.ndarray  # (2,) in the part's frame
    turn: float  # rad, about z
    floating: bool = False


@dataclass
class Part:
    mass: float
    inertia: float
    centre: np.ndarray  # (2,) in the part's frame
    start: np.ndarray  # x, y and angle at the start
    velocity: np.ndarray  # velocity of the centre of mass, and angular velocity
    label: str = ""


def turn_of(reuler: tuple[float, ...]) -> float:
    """Return the rotation about z for body-fixed 3-1-3 angles that keep z, or turn it twice by pi."""
    a, b, c = reuler or (0.0, 0.0, 0.0)
    assert abs(math.sin(b)) < 1e-12, "planar models turn about z alone"
    return a + math.cos(b) * c


def rotation(angle: float) -> np.ndarray:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    if x <= x0:
        return h0
    if x >= x1:
        return h1
    s = (x - x0) / (x1 - x0)
    return h0 + (h1 - h0) * s * s * (3.0 - 2.0 * s)


def impact(x: float, v: float, x1: float, k: float, e: float, c: float, d: float) -> float:
    assert x1 > 0.0, "IMPACT wants a free length above zero"
    assert min(k, e, d) > 0.0
    if x >= x1:
        return 0.0
    return max(0.0, k * (x1 - x) ** e - step(x, x1 - d, c, x1, 0.0) * v)


FUNCTIONS = {
    "STEP": step, "IMPACT": impact, "ABS": abs, "MAX": max, "MIN": min, "SQRT": math.sqrt, "SIN": math.sin,
    "COS": math.cos, "SIGN": lambda a, b: math.copysign(abs(a), b), "MOD": math.fmod,
    "ADAMS_IF": lambda e, negative, zero, positive: (negative if e < 0 else zero if e == 0 else positive)(),
}  # fmt: skip


def compile_expression(text: str):
    """Compile an expression of ADAMS to Python code. IF(e: a, b, c) evaluates only the chosen branch."""
    text = text.upper()
    assert "--" not in text.replace(" ", ""), f"two minus signs in a row: {text}"

    def choices(match_text: str) -> str:
        while (found := re.search(r"\bIF\(", match_text)) is not None:
            depth, parts, start = 1, [], found.end()
            position = start
            while depth:
                character = match_text[position]
                depth += {"(": 1, ")": -1}.get(character, 0)
                if (depth == 1 and character in ":,") or depth == 0:
                    parts.append(match_text[start:position])
                    start = position + 1
                position += 1
            assert len(parts) == 4, f"IF takes e: a, b, c in {match_text}"
            e, *rest = parts
            chosen = f"ADAMS_IF({e}, " + ", ".join(f"lambda: ({part})" for part in rest) + ")"
            match_text = match_text[: found.start()] + chosen + match_text[position:]
        return match_text

    source = choices(text)
    names = {node.id for node in ast.walk(ast.parse(source.strip(), mode="eval")) if isinstance(node, ast.Name)}
    allowed = {*FUNCTIONS, *MEASURES, "TIME", "PI", "DTOR", "RTOD"}
    assert names <= allowed, f"unknown names: {sorted(names - allowed)}"
    return compile(source.strip(), "expression", "eval")


def zero(*markers: int) -> float:
    return 0.0


class Motion:
    """Positions and velocities of parts and markers of a dataset in one state. Each is computed once."""

    def __init__(self, dataset, q, u) -> None:
        self.dataset, self.known = dataset, {}
        # position, angle, its cosine and sine, rates
        self.frames = {dataset.ground: (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)}
        q, u = q.tolist(), u.tolist()
        for part, i in dataset.index.items():
            x, y, turn = q[i : i + 3]
            self.frames[part] = (x, y, turn, math.cos(turn), math.sin(turn), *u[i : i + 3])

    def of(self, marker):
        """Return position, angle, velocity and angular velocity of a marker, and its lever from the part's origin."""
        if (known := self.known.get(marker)) is None:
            m = self.dataset.markers[marker]
            x, y, turn, cos, sin, vx, vy, spin = self.frames[m.part]
            ahead, up = m.place.tolist()
            rx, ry = cos * ahead - sin * up, sin * ahead + cos * up
            known = (x + rx, y + ry, turn + m.turn, vx - spin * ry, vy + spin * rx, spin, rx, ry)
            self.known[marker] = known
        return known

    def centres(self):
        """Return the levers from the origins of parts to their centres of mass."""
        for identity, part in self.dataset.parts.items():
            (ahead, up), cos, sin = part.centre.tolist(), *self.frames[identity][3:5]
            yield cos * ahead - sin * up, sin * ahead + cos * up

    def seen(self, first, i, j, k):
        """Return the vector from J to I in the frame of K, from positions or velocities.

        If J or K is omitted, it is the ground's.
        """
        x, y = self.of(i)[first : first + 2]
        if j:
            there = self.of(j)
            x, y = x - there[first], y - there[first + 1]
        if k:
            turn = self.of(k)[2]
            x, y = math.cos(turn) * x + math.sin(turn) * y, math.cos(turn) * y - math.sin(turn) * x
        return x, y

    def dx(self, i, j=0, k=0):
        return self.seen(0, i, j, k)[0]

    def dy(self, i, j=0, k=0):
        return self.seen(0, i, j, k)[1]

    def vx(self, i, j=0, k=0, frame=0):
        return self.velocity(i, j, k, frame)[0]

    def vy(self, i, j=0, k=0, frame=0):
        return self.velocity(i, j, k, frame)[1]

    def velocity(self, i, j, k, frame):
        assert not frame or self.dataset.markers[frame].part == self.dataset.ground, "differentiated in the ground"
        return self.seen(3, i, j, k)

    def spin(self, i, j=0, k=0):
        return self.of(i)[5] - (self.of(j)[5] if j else 0.0)

    def angle(self, i, j=0):
        return self.of(i)[2] - (self.of(j)[2] if j else 0.0)


class Sensor:
    """A SENSOR that triggers when its expression is no longer below its value."""

    def __init__(self, statement: Statement) -> None:
        assert "GE" in statement.flags
        assert ("HALT" in statement.flags) != ("RETURN" in statement.flags)
        assert 0.0 < statement.numbers("ERROR")[0] <= 1e-3
        self.expression, (self.value,) = compile_expression(statement.arguments["FUNCTION"]), statement.numbers("VALUE")
        self.halts, self.label = "HALT" in statement.flags, statement.label


class HaltError(Exception):
    """A sensor halted the run. The message names it and the time."""


@dataclass
class Dataset:
    """A planar model of ADAMS as its text defines it, in the units of the dataset (lengths, kg, s)."""

    text: str
    statements: list[Statement] = field(init=False)

    def __post_init__(self) -> None:
        self.statements = read_statements(self.text)
        self.markers = {s.id: self._marker(s) for s in self.of("MARKER")}
        self.ground = next(s.id for s in self.of("PART") if "GROUND" in s.flags)
        self.parts = {s.id: self._part(s) for s in self.of("PART") if s.id != self.ground}
        self.index = {part: 3 * place for place, part in enumerate(self.parts)}
        self.variables = {s.id: compile_expression(s.arguments["FUNCTION"]) for s in self.of("VARIABLE")}
        components = ("FX", "FY", "TZ")
        self.forces = [
            (s.marker("I"), s.marker("RM"), [compile_expression(s.arguments[key]) for key in components])
            for s in self.of("GFORCE")
        ]
        self.reactions = [s.marker("JFLOAT") for s in self.of("GFORCE")]
        self.single = [(s, compile_expression(s.arguments["FUNCTION"])) for s in self.of("SFORCE")]
        self.sensors = {s.id: Sensor(s) for s in self.of("SENSOR")}
        self.inactive: set[tuple[str, int]] = set()
        joints = {s.id: s for s in self.of("JOINT")}
        self.motions = {}
        for s in self.of("MOTION"):
            assert {"ROTATION", "VELOCITY"} <= set(s.flags)
            assert float(s.arguments["FUNCTION"]) == 0.0
            joint = joints[s.marker("JOINT")]
            self.motions[s.id] = self.relative_turn(joint.marker("I"), joint.marker("J"))
        for s in self.of("GFORCE"):
            assert all(float(s.arguments[key]) == 0.0 for key in ("FZ", "TX", "TY"))
        (units,) = self.of("UNITS")
        assert (units.arguments["MASS"], units.arguments["TIME"]) == ("KILOGRAM", "SECOND")
        assert units.arguments["FORCE"] == "NEWTON"
        self.metre = 1.0 / LENGTHS_M[units.arguments["LENGTH"]]  # lengths of the dataset in a metre
        (gravity,) = self.of("ACCGRAV")
        self.gravity = np.array([gravity.numbers(key, (0.0,))[0] for key in ("IGRAV", "JGRAV")])
        assert gravity.numbers("KGRAV", (0.0,)) == (0.0,)

    def of(self, name: str) -> list[Statement]:
        return [statement for statement in self.statements if statement.name == name]

    def _marker(self, s: Statement) -> Marker:
        place = s.numbers("QP", (0.0, 0.0, 0.0))
        return Marker(s.marker("PART"), np.array(place[:2]), turn_of(s.numbers("REULER")), "FLOATING" in s.flags)

    def _part(self, s: Statement) -> Part:
        place, turn = s.numbers("QG", (0.0, 0.0, 0.0)), turn_of(s.numbers("REULER"))
        assert place[2] == 0.0
        centre = self.markers[s.marker("CM")]
        assert centre.part == s.id
        inertia = s.numbers("IP", (0.0, 0.0, 0.0))
        assert all(abs(product) == 0.0 for product in inertia[3:])
        assert "IM" not in s.arguments
        assert "VM" not in s.arguments
        velocity = [s.numbers(key, (0.0,))[0] for key in ("VX", "VY", "WZ")]
        assert all(s.numbers(key, (0.0,)) == (0.0,) for key in ("VZ", "WX", "WY"))
        return Part(
            s.numbers("MASS")[0], inertia[2], centre.place, np.array([*place[:2], turn]), np.array(velocity), s.label
        )

    # kinematics -----------------------------------------------------------------------------------------------------
    def place(self, q, marker):
        x, y, turn, *_ = Motion(self, q, np.zeros_like(q)).of(marker)
        return np.array([x, y]), turn

    def velocity(self, q, u, marker):
        *_, vx, vy, spin = Motion(self, q, u).of(marker)[:6]
        return np.array([vx, vy]), spin

    def value(self, expression, t, q, u) -> float:
        return float(eval(expression, self.environment(t, Motion(self, q, u))))

    def environment(self, t, motion):
        """Return the names that an expression may use, with their values at one state."""
        names = FUNCTIONS | {"TIME": t, "PI": math.pi, "DTOR": math.pi / 180.0, "RTOD": 180.0 / math.pi}
        names |= {"DX": motion.dx, "DY": motion.dy, "VX": motion.vx, "VY": motion.vy, "WZ": motion.spin}
        names |= {"AZ": motion.angle, "DZ": zero, "VZ": zero, "WX": zero, "WY": zero}
        values: dict[int, float] = {}

        def variable(identity):
            if identity not in values:
                values[identity] = eval(self.variables[identity], names)
            return values[identity]

        names["VARVAL"] = variable
        return names

    # dynamics -------------------------------------------------------------------------------------------------------
    @cached_property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        q = np.concatenate([part.start for part in self.parts.values()])
        u = np.zeros_like(q)
        for identity, part in self.parts.items():
            i = self.index[identity]
            lever = rotation(q[i + 2]) @ part.centre
            u[i : i + 2] = part.velocity[:2] - part.velocity[2] * np.array([-lever[1], lever[0]])
            u[i + 2] = part.velocity[2]
        return q, u

    @cached_property
    def mass_upright(self) -> np.ndarray:
        """Return the mass matrix without the terms that turn with the parts."""
        diagonal = [(p.mass, p.mass, p.inertia + p.mass * p.centre @ p.centre) for p in self.parts.values()]
        return np.diag(np.concatenate(diagonal))

    def mass(self, q):
        """Return the mass matrix in the coordinates of the parts."""
        out = self.mass_upright.copy()
        for (identity, part), (x, y) in zip(self.parts.items(), Motion(self, q, q).centres(), strict=True):
            i = self.index[identity]
            out[i, i + 2] = out[i + 2, i] = -part.mass * y
            out[i + 1, i + 2] = out[i + 2, i + 1] = part.mass * x
        return out

    def applied(self, t, q, u):
        """Return the generalised forces of gravity, of force expressions and of centripetal terms."""
        motion, out = Motion(self, q, u), [0.0] * len(q)
        environment = self.environment(t, motion)
        gx, gy = self.gravity.tolist()
        for (identity, part), (x, y) in zip(self.parts.items(), motion.centres(), strict=True):
            i, spin = self.index[identity], motion.frames[identity][7]
            fx, fy = part.mass * (gx + spin**2 * x), part.mass * (gy + spin**2 * y)
            out[i], out[i + 1], out[i + 2] = fx, fy, x * fy - y * fx
        for (marker, frame, expressions), reaction in zip(self.forces, self.reactions, strict=True):
            # A newton is a kilogram times `metre` lengths of the dataset per second squared.
            fx, fy, tz = (self.metre * eval(expression, environment) for expression in expressions)
            turn = motion.of(frame)[2]
            along, upward = math.cos(turn) * fx - math.sin(turn) * fy, math.sin(turn) * fx + math.cos(turn) * fy
            self._apply(out, motion, marker, along, upward, tz)
            # A floating marker is at I, on the part that takes the reaction.
            assert self.markers[reaction].floating
            assert self.markers[reaction].part == self.ground
        for statement, expression in self.single:
            if ("SFORCE", statement.id) in self.inactive:
                continue
            value = self.metre * eval(expression, environment)
            assert "ROTATIONAL" in statement.flags, "translational forces along z do not occur in planar models"
            self._apply(out, motion, statement.marker("I"), 0.0, 0.0, value)
            if "ACTIONONLY" not in statement.flags:
                self._apply(out, motion, statement.marker("J"), 0.0, 0.0, -value)
        return np.array(out)

    def _apply(self, out, motion, marker, fx, fy, torque):
        part = self.markers[marker].part
        if part != self.ground:
            i, (*_, x, y) = self.index[part], motion.of(marker)
            out[i] += fx
            out[i + 1] += fy
            out[i + 2] += x * fy - y * fx + torque

    @cached_property
    def joints(self) -> tuple[list[tuple[int, int, int]], np.ndarray]:
        """Return (row, I, J) of the joints that hold two markers together, and the constant part of all constraint
        rows.
        """
        pins, rows, width = [], [], 3 * len(self.parts)
        joints = {s.id: s for s in self.of("JOINT")}
        for s in joints.values():
            i, j = s.marker("I"), s.marker("J")
            if "PLANAR" in s.flags:
                assert self.ground in (self.markers[i].part, self.markers[j].part)
                continue
            assert {"REVOLUTE"} <= set(s.flags) or {"FIXED"} <= set(s.flags), s.flags
            pins.append((len(rows), i, j))
            rows += [np.zeros(width), np.zeros(width)]
            for marker, sign in ((i, 1.0), (j, -1.0)):
                if (part := self.markers[marker].part) != self.ground:
                    rows[-2][self.index[part]] += sign
                    rows[-1][self.index[part] + 1] += sign
            if "FIXED" in s.flags:
                rows.append(self.relative_turn(i, j))
        for s in self.of("COUPLER"):
            ids, scales = (s.numbers(key) for key in ("JOINTS", "SCALES"))
            turns = (self.relative_turn(joints[int(id)].marker("I"), joints[int(id)].marker("J")) for id in ids)
            rows.append(sum(scale * turn for scale, turn in zip(scales, turns, strict=True)))
        return pins, np.array(rows).reshape(len(rows), width)

    def constraints(self, q, u):
        """Return the rows of the Jacobian of the constraints, and minus their derivative times the rates."""
        motion, (pins, steady) = Motion(self, q, u), self.joints
        held = [row for identity, row in self.motions.items() if ("MOTION", identity) not in self.inactive]
        steady = np.vstack((steady, *held))
        g, bias = steady.copy(), np.zeros(len(steady))
        for row, i, j in pins:
            for marker, sign in ((i, 1.0), (j, -1.0)):
                if (part := self.markers[marker].part) != self.ground:
                    *_, spin, x, y = motion.of(marker)
                    g[row, self.index[part] + 2] -= sign * y
                    g[row + 1, self.index[part] + 2] += sign * x
                    bias[row] += sign * spin**2 * x
                    bias[row + 1] += sign * spin**2 * y
        return g, bias

    def relative_turn(self, i, j):
        row = np.zeros(3 * len(self.parts))
        for marker, sign in ((i, 1.0), (j, -1.0)):
            if (part := self.markers[marker].part) != self.ground:
                row[self.index[part] + 2] += sign
        return row

    def rate(self, t, y):
        q, u = y[: y.size // 2], y[y.size // 2 :]
        g, bias = self.constraints(q, u)
        n, m = len(q), len(g)
        # Lengths may be in millimetres. Scale both blocks to similar sizes before solving.
        near = 1.0 / np.sqrt(self.mass_upright.diagonal())
        scale = np.concatenate([near, 1.0 / np.sqrt(((g * near) ** 2).sum(axis=1))])
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = self.mass(q), g.T, g
        right = np.concatenate([self.applied(t, q, u), bias])
        solution = scale * np.linalg.solve(scale[:, None] * matrix * scale, scale * right)
        return np.concatenate([u, solution[:n]])

    def degrees_of_freedom(self) -> int:
        return 3 * len(self.parts) - len(self.constraints(*self.start)[0])

    def run(self, commands: str, rtol=1e-9, atol=1e-9, method="LSODA") -> list[tuple[str, float]]:
        """Run a command file (.acf) from the initial conditions. Return the sensors that ended simulations, and when.

        Raises HaltError if a sensor halts the run.
        """
        t, y, triggered = 0.0, np.concatenate(self.start), []
        for line in commands.splitlines()[2:]:
            words = [word.strip() for word in line.split(",")]
            if words[0] in ("activate/sensor", "activate/motion", "activate/sforce"):
                self.inactive.remove((words[0].partition("/")[2].upper(), int(words[1].partition("=")[2])))
            elif words[0].startswith("deactivate/"):
                self.inactive.add((words[0].partition("/")[2].upper(), int(words[1].partition("=")[2])))
            elif words[0] == "simulate/dynamic":
                sensor, t, y = self.simulate(t, y, float(words[1].partition("=")[2]), (rtol, atol, method))
                triggered += [(sensor.label, t)] if sensor else []
            else:
                assert words[0] in ("integrator/hht", "stop"), line
        return triggered

    def simulate(self, t, y, end_s, how):
        """Integrate until a sensor triggers or until the end. Return the sensor, or None, with time and state."""
        active = [sensor for identity, sensor in self.sensors.items() if ("SENSOR", identity) not in self.inactive]
        rtol, atol, method = how

        def event_of(sensor):
            def event(t, y):
                return self.value(sensor.expression, t, y[: y.size // 2], y[y.size // 2 :]) - sensor.value

            event.terminal, event.direction = True, 1.0
            return event

        events = [event_of(sensor) for sensor in active]
        true = [sensor for sensor, event in zip(active, events, strict=True) if event(t, y) >= 0.0]
        if not true:
            solution = solve_ivp(self.rate, (t, end_s), y, method, events=events, rtol=rtol, atol=atol, first_step=1e-7)
            assert solution.success
            t, y = solution.t[-1], solution.y[:, -1]
            true = [sensor for sensor, times in zip(active, solution.t_events, strict=True) if times.size]
        for sensor in true:
            if sensor.halts:
                raise HaltError(f"{sensor.label} at {t:.6f} s")
        return (true[0] if true else None), t, y

    def integrate(self, end_s: float, rtol=1e-10, atol=1e-10, events=(), method="Radau", first_step=1e-6):
        """Integrate from the initial conditions. `events` are functions of (t, q, u)."""
        wrapped = []
        for event in events:

            def function(t, y, event=event):
                return event(t, y[: y.size // 2], y[y.size // 2 :])

            function.terminal = getattr(event, "terminal", False)
            function.direction = getattr(event, "direction", 0.0)
            wrapped.append(function)
        y = np.concatenate(self.start)
        return solve_ivp(
            self.rate, (0.0, end_s), y, method, events=wrapped, rtol=rtol, atol=atol, first_step=first_step,
            dense_output=True,
        )  # fmt: skip
