"""Optimise a quantity of the gait by varying parameters of the walker within bounds."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from walkerlab.config import analyses, schema, walkers
from walkerlab.config.reads import DesignConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label
from walkerlab.physics.orbits import fixed_point, newton
from walkerlab.physics.orbits.design import (
    BOUND_TOLERANCE,
    DesignProblem,
    DesignSearch,
    Point,
    count_optima,
    minimise,
    search_from_starts,
)
from walkerlab.physics.orbits.gradients import gait_quantities
from walkerlab.physics.orbits.robustness import LARGEST, GaitOnMap, largest_disturbance
from walkerlab.physics.orbits.step_map import gait_near, multipliers_of
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store.content import Content, rows_group
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene.parameter import Parameter, config_with, parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import ModelUnderTest, find_model_gait, refuse_unread, section_coordinates

SOLVED: Final = newton.Effort(1e-10)
DIFFERENCE: Final = 5e-3  # finite-difference step for largest disturbances, as a fraction of the range of the bounds
FINE_WIDTH: Final = 1e-10  # accuracy of largest disturbances; at a coarser one, noise would mislead the search
ROBUSTNESS: Final = ("gait_sensitivity_norm", *LARGEST)  # quantities compared between start and optimum
MEETING_GAP: Final = 1e-3  # the two largest multipliers meet if their magnitudes differ by less than this
LABELS: Final = {
    "to": Label("", "parameter of the config"),
    "start": Label("SI", "start of the search"),
    "best": Label("SI", "optimum, in the unit of the key"),
}
WIDEN_ADVICE: Final = "Widen the bounds (--over), or the constraints (--keep)."


def run(config: DesignConfig, inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint) -> Content:
    """Search for the optimum.

    checkpoint  results of the searches that an earlier run completed; new results are added

    Raises ConfigError for an invalid request, NoAnswer if no walker meets the constraints.
    """
    refuse(config)
    design = config.design or analyses.Design()
    quantity = design.minimise or design.maximise
    assert quantity is not None, "refuse rejects a design without a quantity"
    gaits = Gaits(config, design, inputs["fixedpoint"].summary, progress)
    lower, upper = np.array(list(design.over.values()), float).T
    keep = {name: (bounds[0], bounds[1]) for name, bounds in design.keep.items()}
    question = DesignProblem(quantity, -1.0 if design.maximise else 1.0, lower, upper, keep, gaits.gait_at)
    current = np.array([parameter.value_in(config) for parameter in gaits.parameters])
    progress.start("design")
    own_gait = gaits.gait_at(current)
    own_z = gaits.z

    def search(number: int, start: Floats) -> DesignSearch:
        progress.start(f"design: search {number + 1} of {design.starts}")
        name = f"search {number}"
        before = gaits.counts.copy()
        # Otherwise the result of this search would depend on the searches before it.
        gaits.z = own_z
        if name in checkpoint.kept:
            counts, gradient_norm, x, gaits.z = np.split(np.array(checkpoint.kept[name]), (2, 3, 3 + current.size))
            point = gaits.gait_at(x)
            gaits.counts = before + counts.astype(int)
            return DesignSearch(x, point, float(gradient_norm[0]))
        result = minimise(question, start)
        if result.point is not None:
            counts = gaits.counts - before
            z = gaits.sections[result.x.tobytes()]
            checkpoint.keep(name, [*counts.tolist(), result.gradient_norm, *result.x.tolist(), *z.tolist()])
        return result

    searches = search_from_starts(question, current, design.starts, config.seed, search)
    if not searches or searches[0].point is None:
        raise NoAnswer(f"no gait of the {design.model} model within the bounds", WIDEN_ADVICE)
    best = searches[0]
    assert best.point is not None
    ends = count_optima(question, searches)
    start = {} if own_gait is None else {"start_value": own_gait.numbers[quantity], "start": dict(own_gait.numbers)}
    progress.start("design: robustness at the start and at the optimum")
    robust = {"start": {} if own_gait is None else gaits.robustness_at(current), "best": gaits.robustness_at(best.x)}
    # 12 digits, so that a bound appears as typed
    optimum = {key: float(f"{value:.12g}") for key, value in zip(design.over, best.x, strict=True)}
    answer = {
        "quantity": quantity,
        "sense": "least" if design.minimise else "largest",
        "model": design.model,
        "best": optimum,
        "value": best.point.numbers[quantity],
        **start,
        "numbers": dict(best.point.numbers),
        "constraints": [
            {"quantity": name, "from": low, "to": high, "value": best.point.numbers[name]}
            for name, (low, high) in keep.items()
        ],
        "on_bound": keys_on_bound(design, best.x),
        "gradient_norm": best.gradient_norm,
        "evaluations": int(gaits.counts[0]),
        "without_gait": int(gaits.counts[1]),
        "optima": ends,
        "starts": design.starts,
        "multipliers_meet": best.point.apart < MEETING_GAP,
        "robustness": [
            {"quantity": name, **{place: of[name] for place, of in robust.items() if name in of}} for name in ROBUSTNESS
        ],
    }
    rows = [
        {"to": key, "start": float(begins), "best": value}
        for (key, value), begins in zip(optimum.items(), current, strict=True)
    ]
    content = Content({"optimum": rows_group(rows, LABELS, "row", "row")}, answer)
    if not ends:
        raise NoAnswer("no walker within the bounds satisfies the constraints on its gait", WIDEN_ADVICE, content)
    return content


def refuse(config: DesignConfig) -> None:
    """Raise ConfigError for an invalid `design` block."""
    design = config.design or analyses.Design()
    if (design.minimise or design.maximise) is None or not design.over:
        advice = "For example --minimise gait_sensitivity_norm --over walker.hip_mass_kg=5:15."
        raise ConfigError("design needs a quantity to optimise and a parameter to vary.", advice)
    if design.model == "contact" and config.contact is None:
        raise walkers.contact_required_error("design.model: contact", config.walker, "Add one.")
    parameters = [parameter_of(key, config, ("design", "over")) for key in design.over]
    for key in design.over:
        refuse_unread("design.over", key, config, (design.model,))
    current = [parameter.value_in(config) for parameter in parameters]
    bounds = list(design.over.values())
    # Each bound must be valid together with the config's values of the other keys, or all lower (or upper) bounds
    # together.
    corners = np.column_stack((current, bounds)).T
    for index, parameter in enumerate(parameters):
        for bound in bounds[index]:
            neighbours = (np.where(np.arange(len(parameters)) == index, bound, corner) for corner in corners)
            if all(config_with(config, parameters, x.tolist()) is None for x in neighbours):
                raise parameter.refusal(config, bound, ("design", "over"))


def keys_on_bound(design: analyses.Design, x: Floats) -> list[str]:
    """Return the keys whose optimum lies on a bound."""
    pairs = zip(design.over.items(), x.tolist(), strict=True)
    return [
        key for (key, (low, high)), value in pairs if min(value - low, high - value) < BOUND_TOLERANCE * (high - low)
    ]


class Gaits:
    """Computes gait and gradients at parameter values. Each search for a gait starts from the last gait found."""

    def __init__(
        self, config: DesignConfig, design: analyses.Design, gait: Mapping[str, Any], progress: Progress
    ) -> None:
        self.config = config
        self.model = design.model
        self.parameters = [parameter_of(key, config) for key in design.over]
        self.progress = progress
        wanted = {*filter(None, (design.minimise, design.maximise)), *design.keep}
        self.wanted = wanted - LARGEST.keys()
        self.largest = wanted & LARGEST.keys()
        self.steps = config.robustness.steps
        self.gaps = [DIFFERENCE * (high - low) for low, high in design.over.values()]
        self.counts = np.zeros(2, int)  # number of evaluations, and of those that found no gait
        self.sections: dict[bytes, Floats] = {}  # section coordinates of gaits, by parameter values
        self.length = float(gait["step_length_m"])
        self.z = find_model_gait(design.model, config, gait, progress.note).z

    def gait_at(self, x: Floats) -> Point | None:
        """Return the gait at parameter values (parameters,), or None if no gait is found or the config rejects them."""
        self.counts[0] += 1
        self.progress.advance()
        changed = config_with(self.config, self.parameters, x.tolist())
        gait = None if changed is None else self.gait_of(changed)
        if gait is None:
            self.counts[1] += 1
        else:
            self.sections[x.tobytes()] = self.z
        return gait

    def gait_of(self, config: schema.Config) -> Point | None:
        """Find the gait of a config near the last gait, or by a search from scratch."""
        subject = ModelUnderTest(self.model, config, self.z, self.length)
        standpoint = subject.gait_on_map()
        match = self.gait_near(standpoint, self.z)
        # Newton's method may have failed because the last gait belongs to parameter values far away.
        if self.model == "rigid" and (match is None or match[1]["spectral_radius"] >= 1.0):
            walker = rigid_walker(config)
            gait = fixed_point.find_gaits(walker, config.seed).gait
            if gait is not None:
                match = self.gait_near(standpoint, section_coordinates(walker, gait.state)) or match
        if match is None:
            return None
        standpoint, numbers = match
        self.z = standpoint.z
        subject = replace(subject, z=standpoint.z)
        by_key = []
        numbers |= self.largest_disturbances(subject, self.largest)
        for parameter, gap in zip(self.parameters, self.gaps, strict=True):
            of_key = subject.gradients(parameter, self.wanted)
            if any(name not in of_key for name in self.wanted):
                return None
            smooth = {name: of_key[name].value or 0.0 for name in self.wanted}
            by_key.append(smooth | self.differentiate_largest(subject, numbers, parameter, gap))
        # Only one multiplier of each complex pair counts, because the two of a pair always have equal magnitudes.
        moduli = np.sort(np.abs([value for value in multipliers_of(standpoint.A) if value.imag >= 0.0]))
        apart = float(moduli[-1] - moduli[-2]) if moduli.size > 1 else 1.0
        gradients = {name: np.array([of_key[name] for of_key in by_key]) for name in (*self.wanted, *self.largest)}
        return Point(numbers, gradients, apart)

    def gait_near(self, standpoint_before: GaitOnMap, z: Floats) -> tuple[GaitOnMap, dict[str, float]] | None:
        """Find the gait near z (d,) and its quantities. Return None if there is no gait or a quantity is undefined."""
        step_map = standpoint_before.step_map
        cycle = gait_near(step_map, z, standpoint_before.p, SOLVED, step_map.stride)
        if isinstance(cycle, newton.NotConverged):
            return None
        standpoint = standpoint_before._replace(z=cycle.z, A=cycle.DP)
        numbers = gait_quantities(standpoint, self.wanted)
        return None if numbers is None or any(name not in numbers for name in self.wanted) else (standpoint, numbers)

    def largest_disturbances(self, subject: ModelUnderTest, names: Collection[str]) -> dict[str, float]:
        """Find the largest disturbances that a gait survives, whichever leg swings. `names` are keys of `LARGEST`."""
        gaits = subject.quick_by_leg()
        return {
            name: min(largest_disturbance(gait, *LARGEST[name], self.steps, FINE_WIDTH) for gait in gaits)
            for name in names
        }

    def differentiate_largest(
        self, subject: ModelUnderTest, numbers: Mapping[str, float], parameter: Parameter, gap: float
    ) -> dict[str, float]:
        """Differentiate the largest disturbances with respect to a parameter.

        The difference is between gaits at values `gap` below and above. If there is no gait on one side, the gait in
        the middle takes its place.
        """
        if not self.largest:
            return {}
        places = {0.0: numbers}
        for off in (-gap, gap):
            changed = parameter.config_at(subject.config, parameter.value_in(subject.config) + off)
            beside = None if changed is None else replace(subject, config=changed)
            match = None if beside is None else self.gait_near(beside.gait_on_map(), subject.z)
            if beside is not None and match is not None:
                places[off] = self.largest_disturbances(replace(beside, z=match[0].z), self.largest)
        first, last = min(places), max(places)
        return {
            name: (places[last][name] - places[first][name]) / (last - first) if last > first else 0.0
            for name in self.largest
        }

    def robustness_at(self, x: Floats) -> dict[str, float]:
        """Return the quantities of `ROBUSTNESS` for the gait at parameter values x, or nothing if it is unstable."""
        config = config_with(self.config, self.parameters, x.tolist())
        assert config is not None, "a walker with a gait is valid"
        subject = ModelUnderTest(self.model, config, self.sections[x.tobytes()], self.length)
        numbers = gait_quantities(subject.gait_on_map(), ROBUSTNESS) or {}
        if ROBUSTNESS[0] not in numbers:
            return {}
        return {ROBUSTNESS[0]: numbers[ROBUSTNESS[0]], **self.largest_disturbances(subject, LARGEST)}
