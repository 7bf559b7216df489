"""Points of a sweep: a stage, parameters with their values, and how these are combined."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from pydantic.fields import FieldInfo

from walkerlab.config import contact, files, problems, reader, schema, tree
from walkerlab.config.fields import annotation_of, leaves, value_at
from walkerlab.errors import ConfigError
from walkerlab.pipeline.headlines import QUANTITIES, has_quantity

Value = float | int | str | bool
Layout = Literal["grid", "list"]

POINT_DIMENSION: Final = "point"
MAX_POINTS: Final = 10_000_000
"""Maximum number of points in a sweep."""
VALUE_FORMS: Final = "FROM:TO:N, FROM:TO:N:log, or a list [a, b, ...]; for --sample also FROM:TO"
EXAMPLE: Final = "For example: `walkerlab sweep --over slope_deg=0.5:5:10 --stage fixedpoint`"
SAMPLERS: Final = ("latin-hypercube", "sobol", "random")


@dataclass(frozen=True)
class Axis:
    """Parameter of a sweep, with its values."""

    key: str  # dotted config key
    values: tuple[Value, ...]  # values in order; if the layout is `list`, one per point
    source: str  # origin of the values, for messages
    ends: tuple[float, float] | None = None  # ends of the interval to sample; None for a list of values

    def setting(self, index: int) -> files.ConfigSetting:
        """Return one value as a `--set` option."""
        value = self.values[index]
        place = tree.Position(self.source, 0, 0)
        return files.ConfigSetting(tuple(self.key.split(".")), tree.Scalar(place, value, str(value)), place)


@dataclass(frozen=True)
class SweptStage:
    """Stage, and the parameter values at which a sweep computes it.

    names   names of the parameters in results: the last part of each key, or more parts if two keys have the same last
    part
    """

    stage: str
    axes: tuple[Axis, ...]
    layout: Layout = "grid"  # grid: all combinations; list: the n-th values form the n-th point

    @property
    def names(self) -> tuple[str, ...]:
        return distinct_ends([axis.key for axis in self.axes])

    @property
    def shape(self) -> tuple[int, ...]:
        if self.layout == "list":
            return (len(self.axes[0].values),)
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        return (POINT_DIMENSION,) if self.layout == "list" else self.names

    def __len__(self) -> int:
        return math.prod(self.shape)

    def places(self, index: int) -> tuple[int, ...]:
        """Return the index of each parameter's value at a point. The last parameter changes fastest."""
        if self.layout == "list":
            return (index,) * len(self.axes)
        import numpy as np

        return tuple(int(place) for place in np.unravel_index(index, self.shape))

    def settings(self, index: int) -> list[files.ConfigSetting]:
        """Return one point as `--set` options."""
        return [axis.setting(place) for axis, place in zip(self.axes, self.places(index), strict=True)]

    def describe_point(self, index: int) -> str:
        places = zip(self.axes, self.places(index), strict=True)
        return ", ".join(f"{axis.key}={axis.values[place]}" for axis, place in places)


def distinct_ends(keys: Sequence[str]) -> tuple[str, ...]:
    """Return the shortest ending of each dotted key that distinguishes it from the others."""
    shortest = []
    for key in keys:
        parts = key.split(".")
        ends = (".".join(parts[start:]) for start in range(len(parts) - 1, -1, -1))
        others = [f".{other}" for other in keys if other != key]
        shortest.append(next(end for end in ends if not any(other.endswith(f".{end}") for other in others)))
    return tuple(shortest)


def build_sweep(
    stage: str, over: Sequence[tuple[str, Any, str]], zipped: bool = False, sample: str = "", seed: int = 1
) -> SweptStage:
    """Build a sweep from command-line options or a `sweep` block.

    over    for each parameter its key, its values (a list, or FROM:TO:N) and where these come from
    zipped  whether the n-th values form the n-th point, instead of the full grid
    sample  such as latin-hypercube:500; empty to use the values themselves

    Raises ConfigError for invalid options.
    """
    axes: tuple[Axis, ...] = ()
    for key, values, source in over:
        axes = (*axes, axis(key, values, source))
        if not (zipped or sample):  # checked here, before the values of the next parameter take more memory
            refuse_too_many("sweep", math.prod(max(1, len(parameter.values)) for parameter in axes))
    keys = [parameter.key for parameter in axes]
    repeated = {key for key in keys if keys.count(key) > 1}
    if not axes or repeated:
        text = f"{min(repeated)}: given twice" if repeated else "no parameter is given"
        raise problems.problem_error(None, f"sweep: {text}", "--over KEY=VALUES, each key once", advice=EXAMPLE)
    if sample:
        return SweptStage(stage, draw_samples(axes, sample, seed), "list")
    for parameter in axes:
        if not parameter.values:
            raise parameter_error(parameter.source, f"{parameter.key}: the number of values is missing", VALUE_FORMS)
    if zipped and len({len(parameter.values) for parameter in axes}) > 1:
        lengths = ", ".join(f"{parameter.key} {len(parameter.values)}" for parameter in axes)
        raise problems.problem_error(None, f"--zip: the parameters have different numbers of values: {lengths}")
    return SweptStage(stage, axes, "list" if zipped else "grid")


def refuse_too_many(what: str, count: int) -> None:
    """Raise ConfigError for more than MAX_POINTS points. `what` is the option or key that requests them."""
    if count > MAX_POINTS:
        raise problems.problem_error(None, f"{what}: {count} points", f"up to {MAX_POINTS} in one sweep")


def axis_of_text(text: str) -> tuple[str, Any, str]:
    """Parse one `--over KEY=VALUES` into key, values and origin.

    Raises ConfigError for any other form.
    """
    key, equals, values = text.partition("=")
    source = f"--over {text}"
    key = key.strip()
    if not equals or not all(key.split(".")):
        raise parameter_error(source, "is not of the form KEY=VALUES", VALUE_FORMS)
    if values.lstrip().startswith("["):
        node = reader.read(values, source, len(key) + 2)
        assert isinstance(node, tree.ListNode)
        return key, [tree.plain(item) for item in node.items], f"--over {key}"
    return key, values.strip(), source


def parameter_error(source: str, text: str, allowed: str = "", near: str = "") -> ConfigError:
    """Build the error for an invalid parameter, option or key. The message names `source` instead of a position in a
    file."""
    return problems.problem_error(tree.Position(source, 0, 0), text, allowed, near)


@cache
def key_fields() -> dict[str, FieldInfo]:
    """Return the field of every config key that holds a value, by dotted key."""
    return {".".join(path): field for path, field in leaves(schema.Config)} | dict(schema.SlopeInDegrees.model_fields)


def axis(key: str, values: Any, source: str) -> Axis:
    """Build the axis of one parameter.

    Raises ConfigError for an unknown key or invalid values.
    """
    fields = key_fields()
    if key not in fields and not any(key.startswith(f"{known_key}.") for known_key in fields):
        if any(known_key.startswith(f"{key}.") for known_key in fields):
            raise parameter_error(source, f"{key}: is a block of keys, not a value")
        if not key.startswith("walker."):  # points may have different walker types, so each is checked
            raise parameter_error(source, f"{key}: unknown key", near=problems.nearest(key, fields))
    if isinstance(values, list | tuple):
        odd = next((value for value in values if not isinstance(value, Value)), None)
        if odd is not None or not values:
            raise parameter_error(source, f"{key}: {odd if values else 'an empty list'}", VALUE_FORMS)
        refuse_too_many(key, len(values))
        return Axis(key, tuple(values), source)
    parts = str(values).split(":")
    try:
        low, high = float(parts[0]), float(parts[1])
        count = int(parts[2]) if len(parts) > 2 else 0
    except (ValueError, IndexError):
        count = -1
    refuse_too_many(f"{key}={values}", count)
    logarithmic = parts[3:] == ["log"]
    if count < 0 or (len(parts) > 2 and count < 1) or len(parts) > 3 + logarithmic or not math.isfinite(low + high):
        raise parameter_error(source, f"{key}: {values} is not a range of values", VALUE_FORMS)
    if logarithmic and min(low, high) <= 0.0:
        raise parameter_error(source, f"{key}: {values}", "both ends above 0 for a logarithmic range")
    return Axis(key, convert_for_key(key, evenly_spaced(low, high, count, logarithmic)), source, (low, high))


def convert_for_key(key: str, values: Sequence[float]) -> tuple[Value, ...]:
    """Convert whole numbers to int if the key takes integers. Other numbers are left for the schema to reject."""
    field = key_fields().get(key)
    if field is None or field.annotation is not int:
        return tuple(values)
    return tuple(int(value) if value.is_integer() else value for value in values)


def evenly_spaced(low: float, high: float, count: int, logarithmic: bool) -> tuple[float, ...]:
    """Return `count` values from `low` to `high`, both included, or only `low` if `count` is 1."""
    import numpy as np

    space = np.geomspace if logarithmic else np.linspace
    return tuple(float(value) for value in space(low, high, count))


def draw_samples(axes: Sequence[Axis], sample: str, seed: int) -> tuple[Axis, ...]:
    """Draw points from the intervals or lists of all parameters.

    sample  SAMPLER:N

    Raises ConfigError for an invalid sampler.
    """
    name, _, number = sample.partition(":")
    if name not in SAMPLERS or not re.fullmatch("[0-9]{1,18}", number) or int(number) < 1:
        allowed = ", ".join(f"{sampler}:N" for sampler in SAMPLERS)
        raise problems.problem_error(
            tree.Position(f"--sample {sample}", 1, 1), "is not a sampler with a number of points", allowed
        )
    refuse_too_many(f"--sample {sample}", int(number))
    import numpy as np

    count = int(number)
    dimensions = len(axes)
    generator = np.random.default_rng(seed)
    if name == "random":
        unit = generator.random((count, dimensions))
    else:
        from scipy.stats import qmc

        if name == "sobol":
            # Sobol sequences are balanced at powers of two, so a full one is drawn and its first `count` points are
            # kept.
            unit = qmc.Sobol(dimensions, seed=generator).random_base2(math.ceil(math.log2(count)))[:count]
        else:
            unit = qmc.LatinHypercube(dimensions, seed=generator).random(count)
    pairs = zip(axes, unit.T, strict=True)
    return tuple(Axis(axis.key, tuple(values_at(axis, column)), axis.source) for axis, column in pairs)


def values_at(axis: Axis, column: Any) -> Iterator[Value]:
    """Map numbers from 0 to 1 to values of one parameter."""
    for share in column.tolist():
        if axis.ends is not None:
            yield from convert_for_key(axis.key, [axis.ends[0] + share * (axis.ends[1] - axis.ends[0])])
        else:
            yield axis.values[min(int(share * len(axis.values)), len(axis.values) - 1)]


def described(config: schema.Config, key: str) -> tuple[str, str]:
    """Return unit and meaning of a key. The unit may depend on the config."""
    *above, last = key.split(".")
    block = value_at(config, above)
    # The block may be of another type than the schema's default, and then has other keys.
    field = key_fields().get(key) or getattr(type(block), "model_fields", {}).get(last)
    if field is None:
        return "1", key
    unit = annotation_of(field, "unit")
    return (config.contact or contact.Contact()).unit_of(unit), field.description or key


def refuse_unrecorded(question: SweptStage, names: Mapping[str, str]) -> None:
    """Raise ConfigError for a quantity that the stage never has. This happens before anything is computed.

    names  requested quantities, by option as typed
    """
    for option, name in names.items():
        if name not in question.names and not has_quantity(question.stage, name):
            quantities = QUANTITIES[question.stage]
            hint = problems.suggestion(name, (*quantities, *question.names))
            shown = (quantity for quantity in quantities if quantity != "outcome")
            listed = ", ".join(quantity + "…" if quantity.endswith(".") else quantity for quantity in shown)
            raise ConfigError(f"{option}: {question.stage} has no such quantity.{hint}", f"Choose from {listed}.")
