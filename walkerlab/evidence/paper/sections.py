"""Report sections on the paper: its numbers next to ours, its tables and its errata."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.evidence.check.section import TONES
from walkerlab.labels import add_unit
from walkerlab.views.report import blocks as page
from walkerlab.views.report.answers import last_steps
from walkerlab.views.report.numbers import count, number, typeset
from walkerlab.views.report.tables import Cell, Column, Table, grouped, table
from walkerlab.views.report.words import describe_error, words

Row = Mapping[str, Any]

TEXT_SUFFIX = "_text"
"""Suffix of the keys whose values are printed numbers, stored as text."""
MODEL_COLUMNS = {"as_printed": "as printed", "corrected": "corrected", "contact": "contact model"}
"""Headers of the columns with which the numbers of the paper are compared, by key."""


def numbers(results: page.Results) -> page.Section | None:
    rows = compared(results, "paper_numbers")
    if not rows:
        return None
    statements = tuple(verdict_statement(name, meaning) for name, meaning in words.terms("paper.verdicts").items())
    departs = words("paper.departs", results.departures) if results.departures else ""
    blocks = (page.Paragraph(departs, "fair"), page.Statements(statements, "lines"), numbers_table(rows))
    return page.Section.create("paper-numbers", "The paper’s numbers", blocks, finding(rows), page.PAPER_PAGE)


def numbers_table(rows: Sequence[Row]) -> Table:
    """Tabulate the paper's numbers, grouped by location, with a column for each model that has values."""
    models = [key for key in MODEL_COLUMNS if any(row.get(key) is not None for row in rows)]
    columns = (
        Column("quantity", lambda row: name_with_unit(row["quantity"], row.get("unit"))),
        Column("printed", "printed", typeset, numeric=True),
        *(Column(MODEL_COLUMNS[key], key, number, numeric=True) for key in models),
        Column("verdict", "verdict", lambda verdict: Cell(spell_verdict(verdict), TONES.get(verdict, "plain"))),
        Column("evidence", "evidence", typeset, wide=True),
    )
    caption = "What the paper prints, and what its equations give"
    return table(caption, columns, grouped(rows, "where"), wordy=True, by="where")


def finding(rows: Sequence[Row]) -> str:
    """Write a sentence on how many numbers of the paper have each verdict."""
    counts = Counter(row["verdict"] for row in rows)
    return words("paper.finding", {name: counts[name] for name in TONES})


def spell_verdict(verdict: str) -> str:
    return verdict.replace("-", " ")


def verdict_statement(name: str, text: str) -> page.Statement:
    return page.Statement(f"{spell_verdict(name).capitalize()}:", text, tone=TONES[name])


def name_with_unit(name: str, unit: str | None) -> str:
    return typeset(add_unit(name, "unit not given" if unit == "not given" else unit or ""))


def compared(results: page.Results, key: str) -> Sequence[Row]:
    """Return the rows at `key` in the summary of `compare`.

    There are none if the stage did not run, or if the walker is not that of the paper.
    """
    rows: Sequence[Row] = results.summary("compare").get(key, ())
    return rows


def tables(results: page.Results) -> page.Section | None:
    summary = results.summary("compare")
    tables_shown = (table_of(key, summary.get(key) or {}) for key in words.terms("paper.tables"))
    return page.Section.create("tables", "The paper’s tables", tables_shown, page=page.PAPER_PAGE)


def table_of(key: str, rows: Any) -> Table:
    """Build the table for a key of the summary of `compare`: a table of the paper, or all numbers of the paper."""
    captions = words.terms("paper.tables")
    if key not in captions:
        return numbers_table(rows)
    return paper_table(captions[key], rows, words.terms("paper.notes").get(key, ""))


def paper_table(caption: str, rows: Mapping[str, Row], note: str) -> Table:
    """Build a table of the paper with the digits as printed. Columns without values are omitted."""
    columns = [Column("symbol" if any("quantity" in row for row in rows.values()) else "quantity", "row")]
    heads = words.terms("paper.heads")
    for key in dict.fromkeys(key for row in rows.values() for key, value in row.items() if value is not None):
        if key == "unit" or key.endswith(TEXT_SUFFIX):
            continue
        texts = any(isinstance(row.get(key), str) for row in rows.values())
        as_text = texts or any(f"{key}{TEXT_SUFFIX}" in row for row in rows.values())
        written = typeset if as_text else partial(number, digits=3 if "percent" in key else 6)
        source = key if texts or not as_text else f"{key}{TEXT_SUFFIX}"
        columns.append(Column(heads.get(key, key.replace("_", " ")), source, written, numeric=not texts))
    names = {symbol: f"{name}, {symbol}" for symbol, name in words.terms("paper.quantities").items()}
    named = [{"row": name_with_unit(names.get(symbol, symbol), row.get("unit")), **row} for symbol, row in rows.items()]
    return table(caption, columns, named, note=note)


ERRATUM_COLUMNS = (
    Column("where", "where", typeset),
    *(Column(name, name, typeset, wide=True) for name in ("printed", "right", "evidence")),
    Column("measured here", "measured", typeset, wide=True),
)


def errors(results: page.Results) -> page.Section | None:
    rows = compared(results, "errata")
    block = table("What is printed, and what is right", ERRATUM_COLUMNS, rows, wordy=True)
    total = f"{count(len(rows), 'error')} and gaps of the paper, with evidence."
    return page.Section.create("errata", "Errata of the paper", (block,), total, page.PAPER_PAGE)


def paper_section(results: page.Results) -> page.Section | None:
    """Summarise the verdicts on the paper and its most serious errors, or return None for any other scene."""
    rows = results.claims
    if not rows:
        return None
    return page.Section("printed", "What the paper prints", tuple(list_verdicts(results, rows)), finding(rows))


def list_verdicts(results: page.Results, rows: Sequence[Row]) -> Iterator[page.PageBlock]:
    """Yield the numbers of the paper by verdict and location, then its most serious errors."""
    places = {name: Counter(row["where"] for row in rows if row["verdict"] == name) for name in TONES}
    parts = tuple((spell_verdict(name), counts.total(), TONES[name]) for name, counts in places.items() if counts)
    yield page.Shares(f"Of {count(len(rows), 'value')} that the paper prints", parts)
    totals = Counter(row["where"] for row in rows)
    texts = {name: words("verdict.places", counts, totals) for name, counts in places.items() if counts}
    statements = (verdict_statement(name, text) for name, text in texts.items())
    yield page.Statements(tuple(statements), "lines")
    gravest = [
        (headline, erratum)
        for place, headline in words.terms("verdict.headlines").items()
        for erratum in compared(results, "errata")
        if erratum["where"].startswith(place)
    ]
    if gravest:
        yield page.Paragraph(words("verdict.reasons"))
        statements = (
            page.Statement(typeset(f"{headline} ({erratum['where']}):"), words("verdict.gravest", erratum), tone="fair")
            for headline, erratum in gravest
        )
        yield page.Statements(tuple(statements), "columns")


QUANTITIES_OF_TABLE_3 = {"t_left": "s", "t_right": "s", "t_cycle": "s", "v_com": "m/s", "E_avg": "J"}
RECORDED_COLUMNS = (
    Column("largest difference", "quantity"),
    Column("from the rigid model", "rigid", number, numeric=True),
    Column("from the contact model", "contact", number, numeric=True),
)


def recorded(results: page.Results) -> page.Section | None:
    """Compare the recorded walk with both models, or return None if no walk was recorded."""
    if (stored := results.summary("compare").get("recorded")) is None:
        return None
    title = f"The recorded walk {stored['name']}"
    return page.Section("recorded", title, tuple(recorded_tables(stored)), describe_recorded(stored))


def describe_recorded(stored: Row) -> str:
    period, length = (stored["steps"]["recorded"][key] for key in ("period_s", "length_m"))
    last = f"{stored['name']}: the last step takes {number(period, 5)} s and is {number(length, 5)} m long."
    return " ".join([last, *stored["doubts"]])


def recorded_tables(stored: Row) -> Iterator[Table]:
    """Yield tables of the recorded walk: the quantities of Table 3 next to both models, then the differences."""
    models = {"rigid": "rigid model", "contact": "contact model", "recorded": str(stored["name"])}
    columns = [Column("quantity", "row"), *(Column(head, key, number, numeric=True) for key, head in models.items())]
    names = words.terms("paper.quantities")
    rows = [
        {"row": name_with_unit(names.get(key, key), unit), **{model: stored["table3"][model][key] for model in models}}
        for key, unit in QUANTITIES_OF_TABLE_3.items()
        if stored["table3"]["recorded"][key] is not None
    ]
    yield table(f"Quantities of Table 3 with {stored['name']}", columns, rows)
    keys = {"max_angle_error_rad": ("angle", "rad"), "max_velocity_error_rad_s": ("angular velocity", "rad/s")}
    differences = [
        {
            "quantity": name_with_unit(f"{name} {words_of_way}", unit),
            **{model: each[key][way] for model, each in stored["differences"].items()},
        }
        for key, (name, unit) in keys.items()
        for way, words_of_way in {"raw": "at the same time", "aligned": "at the same phase"}.items()
    ]
    yield table(f"Differences of {stored['name']} from both models", RECORDED_COLUMNS, differences)


def answer(summary: Row) -> list[str | Table]:
    """Report the verdicts on the numbers of the paper or, for another walker, the differences between the models."""
    errors = summary.get("numerical_error", {})
    error_lines: list[str | Table] = [
        f"numerical error of the {model} walk: {describe_error(error)}." for model, error in errors.items()
    ]
    if "recorded" in summary:
        error_lines += ["", describe_recorded(summary["recorded"]), *recorded_tables(summary["recorded"])]
    if "verdicts" in summary:
        return [finding(summary["paper_numbers"]), numbers_table(summary["paper_numbers"]), *error_lines]
    return [words("models.answer", summary["outcomes"]), last_steps(summary, errors), *error_lines]
