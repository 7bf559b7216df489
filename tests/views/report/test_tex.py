"""Tests of LaTeX tables: decimals are aligned, digits are equal in a column, and heads and captions are in words."""

import pytest
from latex import compile_tables

from walkerlab.evidence.paper.sections import table_of
from walkerlab.views.report.tables import Column, as_csv, record_table, table
from walkerlab.views.report.tex import WITHOUT_GRAPHICX, as_tex, escape_tex

END = r" \\"
SMALL_TABLE = table("Periods", [Column("period (s)", numeric=True)], [[0.7036]])


def tex_of(*values, title="period (s)"):
    records = [{"value": value} for value in values]
    return as_tex(table("Periods", [Column(title, "value", numeric=True)], records)).decode()


def cells(text):
    lines = text.splitlines()
    return [line.removesuffix(END) for line in lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")]]


def test_numbers_in_a_latex_column_have_equally_many_decimals():
    text = tex_of(0.7, 0.70638, -1.25)
    assert r"\begin{tabular}{S[table-format=-1.4]}" in text
    assert cells(text) == ["0.7000", "0.7064", "-1.2500"]
    assert cells(tex_of(3, 12)) == ["3", "12"]


def test_numbers_of_different_magnitude_keep_their_significant_digits():
    text = tex_of(1e5, 0.5, 2e-9, 0.0)
    assert r"\begin{tabular}{S[table-format=1.5e-1]}" in text
    assert cells(text) == ["1.0000e5", "0.50000", "2.0000e-9", "0"]


def test_latex_table_starts_with_packages_and_caption():
    begin = ["% \\usepackage{booktabs, graphicx, siunitx}", WITHOUT_GRAPHICX]
    text = tex_of(0.5)
    assert text.splitlines()[:5] == [*begin, r"\begin{table}", r"\centering", r"\caption{Periods.}"]
    assert "{period} \\\\\n{(s)} \\\\\n\\midrule" in text


def test_texts_in_number_columns_are_braced():
    assert cells(tex_of(0.5, None, "walked")) == ["0.50000", "{--}", "{walked}"]
    assert r"\begin{tabular}{l}" in tex_of("walked", "fell")


def test_latex_tables_of_the_paper_keep_the_printed_digits_and_have_a_caption():
    row = {"unit": "s", "paper_matlab": 0.6, "paper_matlab_text": "0.60", "corrected": 0.7036, "contact": 0.7111}
    text = as_tex(table_of("table3", {"t_left": row})).decode()
    assert r"\caption{Table 3: characteristics of the walk, in the paper and here." in text
    head = [r" & {paper,} &  & {contact} \\", r"quantity & {MATLAB} & {corrected} & {model} \\", r"\midrule"]
    assert "\n".join(head) in text
    assert r"left step period, $t_\mathrm{left}$ (s) & 0.60 & 0.70360 & 0.71110 \\" in text


def wide_table():
    columns = [Column("walker and ground", "name"), Column("what was seen of it", "text")]
    columns += [Column(f"quantity number {place} (rad/s)", f"x{place}", numeric=True) for place in range(16)]
    numbers = {f"x{place}": 10.0**-place for place in range(16)}
    text = "a walk of many words, at 10⁻¹² and 4.5 × 10^-13 m/s², with t₁₂ and θ̇₁, that would not fit a line"
    rows = [{"name": "kneed", "text": text, **numbers}, {"name": "x" * 60, "text": "y" * 80, **numbers}]
    return table("Many columns", columns, rows)


@pytest.mark.parametrize("options", ["", "twocolumn"])
def test_tables_compile_and_stay_within_the_text_block(options, tmp_path):
    texts = [as_tex(content, columns).decode() for content in (wide_table(), SMALL_TABLE) for columns in (1, 2)]
    assert compile_tables(texts, options, tmp_path) == []


def test_two_column_table_spans_both_columns():
    for columns, kind in ((1, "table"), (2, "table*")):
        text = as_tex(SMALL_TABLE, columns).decode()
        assert text.splitlines()[2] == rf"\begin{{{kind}}}"
        assert text.endswith(f"\\end{{{kind}}}\n")


def test_units_have_a_separate_row_under_multiline_headers():
    columns = [Column("walk"), Column("length of the longest step (m)", numeric=True), Column("steps", numeric=True)]
    text = as_tex(table("Walks", columns, [["rigid", 0.3714, 10]])).decode()
    head = text[text.index(r"\toprule") : text.index(r"\midrule")].splitlines()[1:]
    assert head == [
        rf" & {{length of}} & {END}", rf" & {{the}} & {END}", rf" & {{longest}} & {END}",
        rf"walk & {{step}} & {{steps}}{END}", rf" & {{(m)}} & {END}",
    ]  # fmt: skip


def test_adjacent_superscripts_are_merged():
    assert escape_tex("10⁻¹² m, x₁², 2^-3") == "10$^{-12}$ m, x$_{1}^{2}$, 2$^{-3}$"


def test_missing_values_are_empty_in_a_file():
    assert as_csv(record_table([{"a": None, "b": 1.5}, {"a": "x", "b": 2.5}])) == b"a,b\n,1.5\nx,2.5\n"
