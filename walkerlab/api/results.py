"""Results of stages in Python: values as attributes, arrays as tables of other libraries, and figures."""

import importlib
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np
from markupsafe import escape
from numpy.typing import NDArray

from walkerlab.config.fields import Block
from walkerlab.config.problems import suggestion
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.pipeline.headlines import headline_values
from walkerlab.pipeline.store.artifact import Identified
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.views.report.tables import format_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame
    from xarray import Dataset

    from walkerlab.views.figures.illustration import Illustration

Value: TypeAlias = "str | float | bool | Sequence[Value] | Mapping[str, Value] | None"
"""A value of a summary: a text, a number, a list, or values by name."""
Setting: TypeAlias = "Value | Block | NDArray[np.generic] | np.generic | Sequence[Setting] | Mapping[str, Setting]"
"""A value of a config key: a text, a number, a list, an array, or a block."""


@dataclass(frozen=True, repr=False)
class Result:
    """Result of a stage. `repr` shows the headline values, and notebooks show the answer with tables.

    Each value of the summary is also an attribute and an item.

    stage      name of the stage
    summary    the values that `--json` prints, in SI units
    content    all labelled arrays, by group
    no_answer  reason why there is no answer, or None if there is one
    artifact   file of the result; None if it was computed in memory

    >>> gait = find_gait()
    >>> gait.period_s == gait["period_s"] == gait.summary["period_s"]
    True
    >>> gait.periods
    Traceback (most recent call last):
    ...
    AttributeError: Gait of fixedpoint has no value 'periods'. Did you mean period_s?
    """

    stage: str
    summary: Mapping[str, Value]
    content: Content
    no_answer: str | None = None
    artifact: Path | None = None

    def __getattr__(self, name: str) -> Value:
        # Python looks up attributes such as __deepcopy__ before there is a summary, for example to restore a copy.
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        if name not in self._values:
            raise AttributeError(self._describe_missing(name))
        return self._values[name]

    def __getitem__(self, name: str) -> Value:
        if name not in self._values:
            raise KeyError(self._describe_missing(name))
        return self._values[name]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *filter(str.isidentifier, self._values)})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._values)

    @property
    def _values(self) -> Mapping[str, Value]:
        return {**headline_values(self.stage, self.summary), **self.summary}

    def _describe_missing(self, name: str) -> str:
        """Explain that the summary has no value of this name, and name the array or the similar value that was probably
        meant."""
        start = f"{type(self).__name__} of {self.stage} has no value {name!r}"
        if self.no_answer is not None:
            return f"{start}: {self.no_answer}."
        if holders := [group for group in self.groups if name in self.content[group].variables]:
            return f"{start}, but an array: dataset({holders[0]!r}).{name}"
        names = ", ".join(headline_values(self.stage, self.summary))
        return f"{start}.{suggestion(name, self._values) or f' It has {names} and more in `summary` and `groups`.'}"

    def __repr__(self) -> str:
        values = headline_values(self.stage, self.summary)
        lines = [f"no answer: {self.no_answer}"] if self.no_answer is not None else []
        lines += [f"  {name:<{max(map(len, values))}}  {format_value(value)}" for name, value in values.items()]
        lines += [f"groups: {', '.join(self.groups)}"] if self.groups else []
        return "\n".join([f"{type(self).__name__} of {self.stage}", *lines])

    def _repr_html_(self) -> str:
        # Imported here, because only notebooks show HTML.
        from walkerlab.views.report.answers import answer_html

        if self.no_answer is not None:
            return f"<p>No answer: {escape(self.no_answer)}</p>"
        return answer_html(self.stage, self.summary)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of arrays, as arguments of `dataset`."""
        return tuple(path for path, group in self.content.groups.items() if group.variables)

    @property
    def advice(self) -> str:
        """Advice on what to try if there is no answer, otherwise empty.

        >>> find_gait(slope_deg=-1).advice.partition(",")[0]
        'Let the slope descend in the walking direction (slope_deg above 0)'
        """
        error = self.content.no_answer
        return "" if error is None else error.advice

    def dataset(self, group: str) -> "Dataset":
        """Return a group of arrays as an xarray Dataset with units and long names.

        group  one of `groups`

        Raises KeyError for an unknown group, ConfigError if xarray is not installed.

        >>> steps = simulate(strides=1).dataset("steps")
        >>> steps.period_s.units, steps.sizes["step"]
        ('s', 2)
        """
        return dataset(self._group(group))

    def _group(self, name: str) -> Group:
        if name not in self.groups:
            raise KeyError(f"{self.stage} has no group {name!r}; its groups: {', '.join(self.groups) or 'none'}")
        return self.content[name]

    def to_dataframe(self, group: str = "") -> "DataFrame":
        """Return a group of arrays, by default the first, as a pandas DataFrame. `attrs["units"]` has units by column.

        The index is made of the dimensions that all arrays share. Other dimensions give columns such as `angle.1`.

        Raises KeyError for an unknown group, ConfigError if pandas is not installed.

        >>> list(simulate(strides=1).to_dataframe("steps").period_s.round(4))
        [0.7036, 0.7036]
        """
        return dataframe(self._group(group or next(iter(self.groups), "")))

    def plot(self, figure: str = "") -> "Figure":
        """Draw a figure of this result as a matplotlib Figure, by default the first one of `figures`.

        Raises ConfigError for an unknown figure.

        >>> simulate(strides=1).plot().savefig(folder / "walk.png")
        """
        figures = self._drawable()
        if figure not in ("", *figures) or not figures:
            advice = f"Choose from {', '.join(figures)}." if figures else "Plot a `dataset` instead."
            raise ConfigError(f"{self.stage}: this result has no figure {figure}".rstrip() + ".", advice)
        return figures[figure or next(iter(figures))].figure({self.stage: cast(Identified, self.content)})

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that show this result alone, as arguments of `plot`."""
        return tuple(self._drawable())

    def _drawable(self) -> "dict[str, Illustration]":
        # Imported here, because it loads matplotlib.
        from walkerlab.views.figures.stage import FIGURES

        results = {self.stage: cast(Identified, self.content)}
        figures = (figure for figure in FIGURES if figure.stages == (self.stage,))
        return {figure.name: figure for figure in figures if figure.why_left_out(results, {}) is None}


@dataclass(frozen=True, repr=False)
class Gait(Result):
    """Result of `fixedpoint`: the chosen gait, and all gaits as arrays.

    >>> gait = find_gait(slope_deg=3)
    >>> gait.stable, gait.groups
    (True, ('corrected/gaits', 'as-printed/gaits'))
    """

    def plot(self, figure: str = "") -> "Figure":
        """Draw the multipliers in the unit circle as a matplotlib Figure.

        Raises NoAnswer if there is no gait.
        """
        from walkerlab.views.figures.families import draw_unit_circle

        if self.no_answer is not None:
            raise NoAnswer(self.no_answer)
        return super().plot(figure) if figure else draw_unit_circle(self.multipliers)

    @property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the chosen gait, largest first, or () if there is no gait.

        >>> gait = find_gait()
        >>> max(abs(one) for one in gait.multipliers) == gait.summary["spectral_radius"]
        True
        """
        pairs = cast("Sequence[Sequence[float]]", self.summary.get("multipliers", ()))
        return tuple(complex(*pair) for pair in pairs)

    if TYPE_CHECKING:

        @property
        def period_s(self) -> float: ...
        @property
        def step_length_m(self) -> float: ...
        @property
        def spectral_radius(self) -> float: ...
        @property
        def stable(self) -> bool: ...


def result_of(
    stage: str, summary: Mapping[str, Value], content: Content, no_answer: NoAnswer | None, path: Path | None = None
) -> Result:
    message = None if no_answer is None else no_answer.message
    kind = Gait if stage == "fixedpoint" else Result
    return kind(stage, summary, content, message, path)


def dataset(group: Group) -> "Dataset":
    """Convert a group of labelled arrays to an xarray Dataset.

    group  such as `result.content["steps"]`; variables named after a dimension become coordinates

    Returns the Dataset, with units and long names. Raises ConfigError if xarray is not installed.

    >>> dataset(simulate(strides=1).content["steps"]).length_m.units
    'm'
    """
    data = {
        name: (variable.dims, variable.values, {"units": variable.units, "long_name": variable.long_name})
        for name, variable in group.variables.items()
    }
    result: Dataset = optional_module("xarray", "a Dataset").Dataset(data, attrs=dict(group.attrs))
    return result.set_coords(str(group.attrs.get("coordinates", "")).split())


def dataframe(group: Group) -> "DataFrame":
    """Convert a group of labelled arrays to a pandas DataFrame.

    Raises ConfigError if pandas is not installed.
    """
    pandas = optional_module("pandas", "a DataFrame")
    variables = group.variables
    sizes = {dim: size for one in variables.values() for dim, size in zip(one.dims, one.values.shape, strict=True)}
    labels = {dim: variables[dim].values if dim in variables else range(sizes[dim]) for dim in sizes}
    arrays = {name: variable for name, variable in variables.items() if name not in sizes}
    shared = [dim for dim in sizes if all(dim in variable.dims for variable in arrays.values())]
    columns: dict[str, NDArray[np.generic]] = {}
    units: dict[str, str] = {}
    for name, variable in arrays.items():
        others = [dim for dim in variable.dims if dim not in shared]
        order = [variable.dims.index(dim) for dim in (*others, *shared)]
        parts = variable.values.transpose(order).reshape(-1, math.prod(sizes[dim] for dim in shared))
        for part, place in zip(parts, itertools.product(*(labels[dim] for dim in others)), strict=True):
            column = ".".join([name, *map(str, place)])
            columns[column], units[column] = part, variable.units
    index = pandas.MultiIndex.from_product([labels[dim] for dim in shared], names=shared)
    # The labels of a MultiIndex are tuples, even if it has one level.
    frame: DataFrame = pandas.DataFrame(columns, index.get_level_values(0) if len(shared) == 1 else index)
    frame.attrs["units"] = units
    return frame


def optional_module(name: str, what: str, title: str = "") -> ModuleType:
    """Import the module `name`, which `what` needs. Messages call the module `title`.

    Raises ConfigError if it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ConfigError(f"{what} needs {title or name}, which is not installed.", f"pip install {name}") from error
