"""Values as CSV, safe to open in a spreadsheet."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

FORMULA = re.compile(r"[=+\-@\t\r]")
"""How texts begin that spreadsheets compute."""
NUMERAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def csv_text(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    """Values as CSV under their heads; nothing where one is missing."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return text.getvalue().encode()


def csv_cell(value: Any) -> Any:
    """A value of a CSV file; a text that a spreadsheet would compute as a formula begins with an apostrophe."""
    if isinstance(value, str) and FORMULA.match(value) and not NUMERAL.fullmatch(value):
        return f"'{value}"
    return "" if value is None else value
