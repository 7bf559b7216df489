"""Extreme cases and known problems: every one judged by measures that the walk itself does not use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeGuard

from walkerlab.config.reads import CompassCasesConfig, SceneCasesConfig, WalksConfig, keys_of
from walkerlab.config.schema import Config
from walkerlab.config.walkers import is_the_papers
from walkerlab.labels import labels_of
from walkerlab.scene.contact import pads_pitch
from walkerlab.scene.left_out import of_verification
from walkerlab.stages.contact_sim import own_pitch, rigid_start
from walkerlab.stages.known_problems import known_group, known_of, known_row
from walkerlab.stages.progress import Progress
from walkerlab.store.columns import rows_group
from walkerlab.store.content import Content, Group
from walkerlab.verification.catalogue import judged
from walkerlab.verification.judge import CaseCell, run_cells
from walkerlab.verification.known import Known
from walkerlab.verification.ordinary import CAP, FINE, Choice
from walkerlab.verification.scene_catalogue import scene_cases
from walkerlab.verification.verdict import CaseResult


def run(
    config: CompassCasesConfig | SceneCasesConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1
) -> Content:
    """Judge the catalogue and the config's own cases, try ordinary methods, and tell of the known problems.

    The paper's compass has a catalogue of named cases; of any other walker it is the scene's own extremes.

    jobs  processes

    Raises ConfigError if a case has the name of another.
    """
    if judged_in_its_scene(config):
        own = scene_cases(spelled_out(config, inputs))
        judged(config.stability.cases, [case for case, _ in own])
        cells = [*(CaseCell(*case) for case in own), *map(CaseCell, config.stability.cases)]
    else:
        cells = [*map(CaseCell, judged(config.stability.cases))]
    progress.start("stability", len(cells))
    cases: list[CaseResult] = []
    ordinary: list[Choice] = []
    for found in run_cells(cells, jobs):
        cases += [item for item in found if isinstance(item, CaseResult)]
        ordinary += [item for item in found if isinstance(item, Choice)]
        progress.advance()
    known = [known_of(row) for row in inputs["known-problems"].summary["known"]]
    summary = summary_of(cases, known, ordinary)
    summary["left_out"] = list(of_verification(config))
    return Content({"cases": cases_group(cases), "known": known_group(known)}, summary | verdict(cases, known))


def judged_in_its_scene(config: CompassCasesConfig | SceneCasesConfig) -> TypeGuard[SceneCasesConfig]:
    """Whether the walker is another one than the paper's compass."""
    return not is_the_papers(config.walker)


def spelled_out(config: WalksConfig, inputs: Mapping[str, Content]) -> Config:
    """The scene with the start, and the pitch of pads, in numbers, so that its cases share them."""
    step, start = rigid_start(config, inputs)
    scene = Config().model_copy(update={key: getattr(config, key) for key in keys_of(WalksConfig)} | {"start": start})
    contact = config.contact
    if contact is None or contact.terrain != "checkerboard":
        return scene
    pitch = pads_pitch(contact, step, own_pitch(config, step, start))
    return scene.model_copy(update={"contact": contact.model_copy(update={"pad_pitch": pitch})})


def verdict(cases: Sequence[CaseResult], known: Sequence[Known]) -> dict[str, Any]:
    """That there is no answer, in words, if something is not as it should be; the results are whole all the same."""
    failed = [*(case.name for case in cases if not case.ok), *(answer.name for answer in known if not answer.ok)]
    if not failed:
        return {}
    message = f"{len(failed)} of {len(cases) + len(known)} did not end as expected: {', '.join(failed)}"
    advice = "`walkerlab report` says in red which and why; `walkerlab stability --json` has every measure."
    return {"no_answer": {"message": message, "advice": advice}}


def summary_of(cases: Sequence[CaseResult], known: Sequence[Known], ordinary: Sequence[Choice]) -> dict[str, Any]:
    """What the command prints."""
    return {
        "cases": [case_row(case) for case in cases],
        "known": [known_row(answer) for answer in known],
        "passed": sum(case.ok for case in cases) + sum(answer.ok for answer in known),
        "failed": sum(not case.ok for case in cases) + sum(not answer.ok for answer in known),
        "ordinary": [ordinary_row(choice) for choice in ordinary],
        "ordinary_cap": CAP,
        "ordinary_fine": FINE,
    }


def case_row(case: CaseResult) -> dict[str, Any]:
    """A case with every measure that was taken."""
    told = {name: value for name, value in asdict(case).items() if name not in ("findings", "remarks")}
    told |= {name: list(told[name]) for name in ("expected", "not_measured")}
    measures = [{"measure": one.measure, "value": one.value, "limit": one.limit, "ok": one.ok} for one in case.findings]
    return {**told, "ok": case.ok, "note": "; ".join(case.failures), "measures": measures}


def ordinary_row(choice: Choice) -> dict[str, Any]:
    """An ordinary method on a case; without an error if it did not arrive."""
    return {name: value for name, value in asdict(choice).items() if value is not None}


def cases_group(cases: Sequence[CaseResult]) -> Group:
    """The table of cases."""
    return rows_group(cases, labels_of(CaseResult), "case", "number of the row")
