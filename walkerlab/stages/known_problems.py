"""Problems with known answers, run through the contact code: the same for every scene, so answered once for all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content, Group, Variable
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
    return {
        "name": answer.name,
        "quantity": answer.quantity,
        "value": answer.value,
        "reference": answer.reference,
        "source": answer.source,
        "error": answer.error,
        "limit": answer.limit,
        "why_limit": answer.why,
        "ok": answer.ok,
        "wall_s": answer.wall_s,
    }


def known_of(row: Mapping[str, Any]) -> Known:
    """The known problem of such a row."""
    keys = ("name", "quantity", "value", "reference", "source", "limit", "why_limit", "wall_s")
    return Known(*(row[key] for key in keys))


def known_group(known: Sequence[Known]) -> Group:
    """The table of known problems."""
    columns: list[tuple[str, Any, str, str]] = [
        ("name", [answer.name for answer in known], "", "name of the problem"),
        ("quantity", [answer.quantity for answer in known], "", "what is compared, with its unit"),
        ("value", [answer.value for answer in known], "1", "by the contact code, in the quantity's unit"),
        ("reference", [answer.reference for answer in known], "1", "by another route, in the quantity's unit"),
        ("error", [answer.error for answer in known], "1", "difference over reference"),
    ]
    return rows_group("problem", len(known), columns)


def rows_group(dim: str, size: int, columns: Sequence[tuple[str, Any, str, str]]) -> Group:
    """Columns over one numbered dimension."""
    variables = {dim: Variable(np.arange(size), (dim,), "1", "number of the row")}
    for name, values, units, text in columns:
        variables[name] = Variable(np.array(values, dtype=object if units == "" else None), (dim,), units, text)
    return Group(variables)
