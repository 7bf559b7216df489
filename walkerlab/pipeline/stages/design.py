"""Optimise parameters of a walker within bounds for a quantity of its gait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from walkerlab.config.design import Design
from walkerlab.config.reads import DesignConfig
from walkerlab.config.schema import Config
from walkerlab.config.walkers import contact_required_error
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label
from walkerlab.physics.orbits.design import (
    BOUND_TOLERANCE,
    DesignProblem,
    DesignSearch,
    Point,
    count_optima,
    minimise,
    search_from_starts,
)
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.gradients import gait_quantities
from walkerlab.physics.orbits.newton import Effort, NotConverged
from walkerlab.physics.orbits.robustness import GaitOnMap
from walkerlab.physics.orbits.step_map import gait_near, multipliers_of
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store.checkpoint import Checkpoint
from walkerlab.pipeline.store.columns import rows_group
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.families import model_reads, unused_key_error
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import ModelUnderTest, find_model_gait, section_coordinates

SOLVED: Final = Effort(1e-10)
MEETING: Final = 1e-3  # relative difference of multipliers that count as meeting
LABELS: Final = {
    "to": Label("", "number of the config"),
    "start": Label("SI", "where the search began"),
    "best": Label("SI", "where the optimum is, in the unit of the key"),
}
ADVICE: Final = "Widen the bounds (--over), or let other numbers go further (--keep)."


def run(config: DesignConfig, inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint) -> Content:
    """Search for the optimum; raises ConfigError for an invalid question, NoAnswer if no walker keeps the bounds.

    checkpoint  ends of searches that an earlier run has left, and where new ones are kept
    """
    refuse(config)
    asked = config.design or Design()
    quantity = asked.minimise or asked.maximise
    assert quantity is not None, "a design without a question is refused"
    parameters = [parameter_of(key, config) for key in asked.over]
    gaits = Gaits(config, asked, parameters, inputs["fixedpoint"].summary, progress)
    lower, upper = np.array(list(asked.over.values()), float).T
    keep = {name: (bounds[0], bounds[1]) for name, bounds in asked.keep.items()}
    question = DesignProblem(quantity, -1.0 if asked.maximise else 1.0, lower, upper, keep, gaits.at)
    own = np.array([parameter.value_in(config) for parameter in parameters])
    progress.start("design")
    begun, own_z = gaits.at(own), gaits.z

    def search(number: int, start: Floats) -> DesignSearch:
        progress.start(f"design: search {number + 1} of {asked.starts}")
        name, before, gaits.z = f"search {number}", gaits.counts.copy(), own_z
        if name in checkpoint.kept:
            kept = np.array(checkpoint.kept[name])
            counts, gradient_norm, x, gaits.z = np.split(kept, (2, 3, 3 + own.size))
            point = gaits.at(x)
            gaits.counts = before + counts.astype(int)
            return DesignSearch(x, point, float(gradient_norm[0]))
        one = minimise(question, start)
        if one.point is not None:
            z = gaits.found[one.x.tobytes()]
            checkpoint.keep(name, [*(gaits.counts - before).tolist(), one.gradient_norm, *one.x.tolist(), *z.tolist()])
        return one

    searches = search_from_starts(question, own, asked.starts, config.seed, search)
    if not searches or searches[0].point is None:
        raise NoAnswer(f"no gait of the {asked.model} model within the bounds", ADVICE)
    best = searches[0]
    assert best.point is not None
    ends = count_optima(question, searches)
    start = {} if begun is None else {"start_value": begun.numbers[quantity], "start": dict(begun.numbers)}
    found = {
        key: float(f"{value:.12g}") for key, value in zip(asked.over, best.x, strict=True)
    }  # a bound as it was given
    said = {
        "quantity": quantity,
        "sense": "least" if asked.minimise else "largest",
        "model": asked.model,
        "best": found,
        "value": best.point.numbers[quantity],
        **start,
        "numbers": dict(best.point.numbers),
        "constraints": [
            {"quantity": name, "from": low, "to": high, "value": best.point.numbers[name]}
            for name, (low, high) in keep.items()
        ],
        "on_bound": on_bound(asked, best.x),
        "gradient_norm": best.gradient_norm,
        "evaluations": int(gaits.counts[0]),
        "without_gait": int(gaits.counts[1]),
        "optima": ends,
        "starts": asked.starts,
        "multipliers_meet": best.point.apart < MEETING,
    }
    rows = [
        {"to": key, "start": float(begins), "best": value}
        for (key, value), begins in zip(found.items(), own, strict=True)
    ]
    content = Content({"optimum": rows_group(rows, LABELS, "row", "row")}, said)
    if not ends:
        raise NoAnswer("no walker within the bounds keeps the other numbers of its gait within theirs", ADVICE, content)
    return content


def refuse(config: DesignConfig) -> None:
    """Raise ConfigError for an invalid question."""
    asked = config.design or Design()
    if (asked.minimise or asked.maximise) is None or not asked.over:
        raise ConfigError(
            "design has no question: it needs a number of the gait and the numbers of the config that may change.",
            "For example --minimise gait_sensitivity_norm --over walker.hip_mass_kg=5:15.",
        )
    if asked.model == "contact" and config.contact is None:
        raise contact_required_error("design.model: contact", config.walker, "Add one.")
    parameters = [parameter_of(key, config, ("design", "over")) for key in asked.over]
    for key in asked.over:
        if not model_reads(asked.model, config, key):
            raise unused_key_error("design.over", key, (asked.model,))
    own, bounds = [parameter.value_in(config) for parameter in parameters], list(asked.over.values())
    corners = np.column_stack((own, bounds)).T
    for place, parameter in enumerate(parameters):
        for bound in bounds[place]:
            beside = (np.where(np.arange(len(parameters)) == place, bound, others) for others in corners)
            if all(config_with(config, parameters, x) is None for x in beside):
                raise parameter.refusal(config, bound, ("design", "over"))


def config_with(config: DesignConfig, parameters: Sequence[Parameter], x: Floats) -> Config | None:
    """Return the config with other parameter values (parameters,); None if it rejects them."""
    changed: Config | None = None
    for parameter, value in zip(parameters, x.tolist(), strict=True):
        changed = parameter.config_at(config if changed is None else changed, value)
        if changed is None:
            break
    return changed


def on_bound(asked: Design, x: Floats) -> list[str]:
    """Return the keys whose optimum lies on a bound."""
    pairs = zip(asked.over.items(), x.tolist(), strict=True)
    return [
        key for (key, (low, high)), value in pairs if min(value - low, high - value) < BOUND_TOLERANCE * (high - low)
    ]


class Gaits:
    """Gait and gradients as functions of the parameters; each search starts at the last gait."""

    def __init__(
        self,
        config: DesignConfig,
        asked: Design,
        parameters: list[Parameter],
        gait: Mapping[str, Any],
        progress: Progress,
    ) -> None:
        """Start at the config's gait."""
        self.config, self.model, self.parameters, self.progress = config, asked.model, parameters, progress
        self.wanted = {*filter(None, (asked.minimise, asked.maximise)), *asked.keep}
        self.counts = np.zeros(2, int)  # evaluations, and those without a gait
        self.found: dict[bytes, Floats] = {}  # section coordinates of gaits, by parameter values
        self.length = float(gait["step_length_m"])
        self.z = find_model_gait(asked.model, config, gait, progress.note).z

    def at(self, x: Floats) -> Point | None:
        """Return the gait; None if there is none or the config rejects the values."""
        self.counts[0] += 1
        self.progress.advance()
        changed = config_with(self.config, self.parameters, x)
        found = None if changed is None else self.gait_of(changed)
        if found is None:
            self.counts[1] += 1
        else:
            self.found[x.tobytes()] = self.z
        return found

    def gait_of(self, config: Config) -> Point | None:
        """Find the gait of a config near the last one, or by a search."""
        subject = ModelUnderTest(self.model, config, self.z, self.length)
        here = subject.at()
        found = self.near(here, self.z)
        if self.model == "rigid" and (found is None or found[1]["spectral_radius"] >= 1.0):  # a long way, perhaps
            walker = rigid_walker(config)
            gait = find_gaits(walker, config.seed).gait
            found = found if gait is None else self.near(here, section_coordinates(walker, gait.state)) or found
        if found is None:
            return None
        here, numbers = found
        self.z, subject, by_key = here.z, replace(subject, z=here.z), []
        for parameter in self.parameters:
            of_key = subject.gradients(parameter, self.wanted)
            if any(name not in of_key for name in self.wanted):
                return None
            by_key.append({name: of_key[name].value or 0.0 for name in self.wanted})
        others = np.sort(np.abs([value for value in multipliers_of(here.A) if value.imag >= 0.0]))
        apart = float(others[-1] - others[-2]) if others.size > 1 else 1.0
        return Point(numbers, {name: np.array([one[name] for one in by_key]) for name in self.wanted}, apart)

    def near(self, at: GaitOnMap, z: Floats) -> tuple[GaitOnMap, dict[str, float]] | None:
        """Find the gait near z (d,) with its quantities; None if one is undefined."""
        cycle = gait_near(at.step_map, z, at.p, SOLVED)
        if isinstance(cycle, NotConverged):
            return None
        here = at._replace(z=cycle.z, A=cycle.DP)
        numbers = gait_quantities(here, self.wanted)
        return None if numbers is None or any(name not in numbers for name in self.wanted) else (here, numbers)
