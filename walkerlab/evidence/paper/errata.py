"""Errata of the paper, with evidence and measurements (made in `study`)."""

import re
from dataclasses import dataclass, fields
from typing import Annotated

from walkerlab.evidence.paper.prose import prose
from walkerlab.evidence.paper.study import PaperStudy
from walkerlab.labels import Label


@dataclass(frozen=True)
class Erratum:
    """Error in the paper."""

    where: Annotated[str, Label("", "location in the paper")]
    printed: Annotated[str, Label("", "printed")]
    right: Annotated[str, Label("", "correct")]
    evidence: Annotated[str, Label("", "argument")]
    measured: Annotated[str, Label("", "values from this run")]


ERRATUM_PARTS = [field.name for field in fields(Erratum)]
ERRATUM_PATTERN = re.compile(" ".join(rf"{name}: (?P<{name}>.*?)" for name in ERRATUM_PARTS) + r"(?= where: |$)")
"""Matches an erratum in the rendered template."""


def errata(study: PaperStudy) -> tuple[Erratum, ...]:
    """Return all errata, by theme and then in the order of the paper's sections."""
    return tuple(Erratum(**match.groupdict()) for match in ERRATUM_PATTERN.finditer(prose("errata.errata", study)))
