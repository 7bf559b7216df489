"""Gaits printed in random conventions, and odd files, for the tests of `walkerlab check`."""

import math
from dataclasses import dataclass

from mistaken_walks import printed

BASE = {
    "origin": "slope-normal", "second": "absolute", "unit": "rad", "positive": "counter-clockwise",
    "order": ("swing", "stance"), "layout": "angles-first", "time": 1.0,
}  # fmt: skip
OTHERS = {
    "origin": ("vertical",), "second": ("relative", "stance-minus-swing"), "unit": ("deg",), "positive": ("clockwise",),
    "order": (("stance", "swing"),), "layout": ("interleaved",), "time": ("sqrt(L/g)", 1.0),
}  # fmt: skip


@dataclass(frozen=True)
class Form:
    """Conventions of a printed state."""

    changes: tuple  # printed names and values that differ from the config

    def __getattr__(self, name):
        return dict(self.changes).get(name, BASE[name])


def random_convention(generator, changes):
    """Return a form with some of its conventions changed."""
    names = generator.sample([*OTHERS], changes)
    return Form(tuple((name, generator.choice(OTHERS[name])) for name in sorted(names)))


def printed_in(form, config, state, period, digits):
    """Return the printed texts of a state just after a heel strike and of its period.

    Angles of `state` are from the slope's normal.
    """
    tilt = config["slope_rad"] if form.origin == "vertical" else 0.0
    swing, stance, swing_rate, stance_rate = state
    legs = {"swing": (swing - tilt, swing_rate), "stance": (stance - tilt, stance_rate)}
    pairs = [legs[name] for name in form.order]
    sign = {"relative": 1.0, "stance-minus-swing": -1.0}.get(form.second)
    if sign is not None:
        pairs[1] = (sign * (swing - stance), sign * (swing_rate - stance_rate))
    length, gravity = config["walker"]["leg_length_m"], config["gravity_m_s2"]
    seconds = 1.0
    if "time" in dict(form.changes):
        # unit of time in which the gravity of the config and that of the script are equal
        seconds = math.sqrt(length / gravity) if form.time == "sqrt(L/g)" else math.sqrt(form.time / gravity)
    factor = (math.degrees(1.0) if form.unit == "deg" else 1.0) * (-1.0 if form.positive == "clockwise" else 1.0)
    pairs = [(factor * angle, factor * rate * seconds) for angle, rate in pairs]
    numbers = [number for pair in pairs for number in pair]
    numbers = numbers if form.layout == "interleaved" else numbers[::2] + numbers[1::2]
    return {"state": printed(numbers, digits), "period_s": printed([period / seconds], digits)[0]}


GOOD = b"""extends: round-feet
name: odd
slope_rad: 0.01
check:
  source: {title: A script, year: 2009, where: line 3}
  angles: {from: slope-normal, second: relative, unit: rad, order: [stance, swing], layout: interleaved}
  instant: after-strike
  state_before: null
  printed:
    state: ['.1895', '-.2391', '.3789', '-.0537']
    period_s: '2.428'
    multipliers: ['0.62', '-0.19+0.56i']
"""
ODD_VALUES = (
    b"nan", b"-.inf", b"1e400", b"''", b"null", b"[]", b"{}", b"[[1]]", b"yes", b"0x1F", b"1_000", b"1:30", b"'0,25'",
    b"'1 m'", b"*a", b"&a 1", b"!!python/object:os.system x", b"\xff\xfe", b"\x00", b"|", b"- -", b"'", b'"', b"{a: 1",
    b"2020-01-01", b"9" * 70, b"'\xe2\x88\x920.2'", b"<<: *x", b"\t", b"?", b"~", b"'<'", b"[1, 2, 3]", b"'1+i'",
)  # fmt: skip


def odd_file(generator, values=ODD_VALUES):
    """Return a config whose text is damaged in one or two places."""
    text = GOOD
    for _ in range(generator.choice((1, 1, 2))):
        lines = text.split(b"\n")
        place = generator.randrange(len(lines))
        line = lines[place]
        how = generator.randrange(5)
        if how == 0:
            del lines[place]
        elif how == 1:
            lines.insert(place, line)
        elif how == 2:
            lines[place] = b" " * generator.randrange(9) + line.strip()
        elif how == 3 and line:
            cut = generator.randrange(len(line))
            lines[place] = line[:cut] + generator.choice(values) + line[cut + 1 :]
        else:
            key, _, _ = line.partition(b":")
            lines[place] = key + b": " + generator.choice(values)
        text = b"\n".join(lines)
    return text
