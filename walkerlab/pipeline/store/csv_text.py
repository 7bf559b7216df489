"""Format values as CSV that is safe to open in a spreadsheet."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

FORMULA = re.compile(r"[=+\-@\t\r]")
"""Pattern of the first character of texts that a spreadsheet would evaluate."""
NUMERAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def csv_text(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    """Format rows as CSV below a header. A missing value becomes an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return text.getvalue().encode()


def csv_cell(value: Any) -> Any:
    """Convert a value to a CSV cell. Text that a spreadsheet would evaluate gets a leading apostrophe."""
    if isinstance(value, str) and FORMULA.match(value) and not NUMERAL.fullmatch(value):
        return f"'{value}"
    return "" if value is None else value
