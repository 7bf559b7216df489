"""Stage `known-problems`: problems with known answers, solved with the contact code. They do not depend on
the scene.
"""

from collections.abc import Mapping
from dataclasses import asdict

from walkerlab.evidence.verification.known import PROBLEMS, Known
from walkerlab.labels import labels_of
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.store.columns import rows_group
from walkerlab.pipeline.store.content import Content


def run(_config: object, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Solve every problem. Wrong answers are stored like right ones, and the stage `stability` reports them."""
    rows = []
    for problem in track(progress, "known problems", len(PROBLEMS), PROBLEMS):
        result = problem()
        rows.append({**asdict(result), "error": result.error, "ok": result.ok})
    right = sum(row["ok"] for row in rows)
    group = rows_group(rows, labels_of(Known), "problem", "number of the row")
    return Content({"known": group}, {"known": rows, "passed": right, "failed": len(rows) - right})
