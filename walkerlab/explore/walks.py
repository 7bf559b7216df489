"""What a question is answered with, in the worker: the stages' summaries and the motion to draw."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from walkerlab.errors import ConfigError
from walkerlab.report.blocks import Walker
from walkerlab.report.outcomes import MODELS
from walkerlab.report.sections.motion import STYLES
from walkerlab.report.tracks import sampling_gap, track_in
from walkerlab.stages.in_memory import InMemory, Keys
from walkerlab.stages.resolve import resolve

STAGES = {"rigid": "simulate", "contact": "contact-sim"}


@dataclass(frozen=True)
class Question:
    """A config, changed.

    config   as `--config` has it
    sets     as `--set` has them
    runs     the folder of all runs
    changes  values by key, over the sets
    models   those that walk
    """

    config: str | None
    sets: tuple[str, ...]
    runs: Path
    changes: Mapping[str, Any]
    models: Sequence[str]


@cache
def memory() -> tuple[InMemory, Keys]:
    """What this process remembers of earlier questions."""
    return InMemory(), Keys()


def answered(question: Question) -> tuple[int, dict[str, Any]]:
    """The status and the object of an answer."""
    changes = [f"{key}={json.dumps(value)}" for key, value in question.changes.items()]
    try:
        config = resolve(question.config, [*question.sets, *changes], None, question.runs).loaded.config
    except ConfigError as error:
        key = next((key for key in question.changes if key in error.message), next(iter(question.changes), None))
        value = None if key is None else question.changes[key]
        return 422, {"error": {"key": key, "value": value, "message": error.message, "advice": error.advice}}
    stages, keys = memory()
    found: dict[str, Any] = {}
    for target in ("fixedpoint", *(STAGES[model] for model in question.models)):
        if target == "contact-sim" and config.contact is None:
            continue
        answer = stages.answer(config, target, keys.of(config, target), again=False)
        found[target] = dict(answer.content.summary)
        if answer.no_answer is not None:
            said = answer.no_answer
            found[target]["error"] = {"message": said.message, "advice": said.advice, "exit_code": said.exit_code}
            if target == "fixedpoint":
                break
        track = track_in(answer.content.groups.get("trajectory"))
        if track is not None and target != "fixedpoint":
            thin = track.thinned(sampling_gap(config))
            strikes = found[target].get("touch_times_s", [])
            meta = Walker(MODELS[target], STYLES[target], thin, tuple(strikes), ()).meta
            found.setdefault("tracks", {})[target] = {"meta": meta, "floats": thin.packed()}
    return 200, found
