"""Stage `stability`: extreme cases and known problems, judged by measures independent of how walks are computed."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeGuard

from walkerlab.config.reads import CompassCasesConfig, SceneCasesConfig, WalksConfig, keys_of
from walkerlab.config.schema import Config, replace_state
from walkerlab.evidence.verification.catalogue import all_cases, scene_cases
from walkerlab.evidence.verification.judge import FINE_ERROR, MAX_ORDINARY_EVALUATIONS, CaseCell, Choice, run_cells
from walkerlab.evidence.verification.verdict import CaseResult
from walkerlab.labels import labels_of
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
from walkerlab.pipeline.store.content import Content, rows_group
from walkerlab.scene.contact import scene_on_pads
from walkerlab.scene.omissions import Entry, omission
from walkerlab.scene.studies import is_studied


def verification_omissions(config: CompassCasesConfig | SceneCasesConfig) -> tuple[Entry, ...]:
    """List the omitted parts of the verification, or return () for the paper's compass."""
    if is_studied(config):
        return ()
    return (
        omission(
            "the named extreme cases",
            "they are cases of the paper's compass, and this walker has other ones",
            "about a hundred cases",
        ),
        omission("ordinary methods on the extreme cases", "they are tested on the paper's compass", "8 runs per case"),
    )


def run(
    config: CompassCasesConfig | SceneCasesConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1
) -> Content:
    """Judge the cases of the catalogue and of the config, try ordinary methods, and report the known problems.

    For a walker other than the paper's compass, the catalogue consists of variations of the scene.

    Raises ConfigError if two cases share a name.
    """
    if has_scene_cases(config):
        variations = scene_cases(resolve_scene(config, inputs))
        all_cases(config.stability.cases, [case for case, _ in variations])
        cells = [*(CaseCell(*case) for case in variations), *map(CaseCell, config.stability.cases)]
    else:
        cells = [*map(CaseCell, all_cases(config.stability.cases))]
    results_by_case = track(progress, "stability", len(cells), run_cells(cells, jobs))
    items: list[CaseResult | Choice] = [result for results in results_by_case for result in results]
    cases = [item for item in items if isinstance(item, CaseResult)]
    problems = inputs["known-problems"]
    summary = summarise(cases, problems.summary["known"], [item for item in items if isinstance(item, Choice)])
    group = rows_group(cases, labels_of(CaseResult), "case", "number of the row")
    summary["left_out"] = list(verification_omissions(config))
    return Content({"cases": group, "known": problems["known"]}, summary)


def has_scene_cases(config: CompassCasesConfig | SceneCasesConfig) -> TypeGuard[SceneCasesConfig]:
    """Whether the cases are variations of the scene, as for every walker except the paper's compass."""
    return not is_studied(config)


def resolve_scene(config: WalksConfig, inputs: Mapping[str, Content]) -> Config:
    """Return the scene with a numeric start and pad pitch, which all its cases share."""
    step, start = rigid_start(config, inputs)
    values = {key: getattr(config, key) for key in keys_of(WalksConfig)}
    scene = Config().model_copy(update=values | {"start": replace_state(config.start, start)})
    contact = config.contact
    if contact is None or contact.terrain != "checkerboard":
        return scene
    pitch = scene_on_pads(config, step, start, asymmetry=step_asymmetry(config, inputs)).pitch_m
    return scene.model_copy(update={"contact": contact.model_copy(update={"pad_pitch": pitch})})


def summarise(
    cases: Sequence[CaseResult], problems: Sequence[Mapping[str, Any]], ordinary: Sequence[Choice]
) -> dict[str, Any]:
    """Build the summary. It contains `no_answer` if a case or problem failed.

    problems  results of the known problems, as stored by their stage
    """
    failed = [*(case.name for case in cases if not case.ok), *(row["name"] for row in problems if not row["ok"])]
    total = len(cases) + len(problems)
    summary = {
        "cases": [case_row(case) for case in cases],
        "known": list(problems),
        "passed": total - len(failed),
        "failed": len(failed),
        # An ordinary method that did not reach the end has no error, and the key must be absent then.
        "ordinary": [{name: value for name, value in asdict(row).items() if value is not None} for row in ordinary],
        "ordinary_cap": MAX_ORDINARY_EVALUATIONS,
        "ordinary_fine": FINE_ERROR,
    }
    if failed:
        message = f"{len(failed)} of {total} did not end as expected: {', '.join(failed)}"
        advice = "`walkerlab report` explains failures in red; `walkerlab stability --json` has every measure."
        summary["no_answer"] = {"message": message, "advice": advice}
    return summary


def case_row(case: CaseResult) -> dict[str, Any]:
    row = {name: value for name, value in asdict(case).items() if name not in ("findings", "remarks")}
    row |= {name: list(row[name]) for name in ("expected", "not_measured")}
    measures = [asdict(measure) | {"ok": measure.ok} for measure in case.findings]
    return {**row, "ok": case.ok, "note": "; ".join(case.failures), "measures": measures}
