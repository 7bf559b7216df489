"""Problems with known answers, run through the contact code: the same for every scene, so answered once for all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from walkerlab.labels import labels_of
from walkerlab.stages.progress import Progress
from walkerlab.store.columns import rows_group
from walkerlab.store.content import Content, Group
from walkerlab.verification.known import PROBLEMS, Known


def run(_config: object, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Answer every problem; an answer that is wrong is kept, and `stability` tells."""
    progress.start("known problems", len(PROBLEMS))
    known = []
    for problem in PROBLEMS:
        known.append(problem.answered())
        progress.advance()
    right = sum(answer.ok for answer in known)
    rows = [known_row(answer) for answer in known]
    return Content({"known": known_group(known)}, {"known": rows, "passed": right, "failed": len(known) - right})


def known_row(answer: Known) -> dict[str, Any]:
    """A known problem as commands print it."""
    return {**asdict(answer), "error": answer.error, "ok": answer.ok}


def known_of(row: Mapping[str, Any]) -> Known:
    """The known problem of such a row."""
    return Known(**{field.name: row[field.name] for field in fields(Known)})


def known_group(known: Sequence[Known]) -> Group:
    """The table of known problems."""
    return rows_group(known, labels_of(Known), "problem", "number of the row")
