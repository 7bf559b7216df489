"""Tables for LaTeX: aligned decimals, one number of digits a column, heads and captions in words."""

from walkerlab.evidence.paper.sections import table_of
from walkerlab.views.report.tables import Column, as_csv, record_table, table
from walkerlab.views.report.tex import as_tex

END = r" \\"


def tex_of(*values, title="period (s)"):
    records = [{"value": value} for value in values]
    return as_tex(table("Periods", [Column(title, "value", numeric=True)], records)).decode()


def cells(text):
    lines = text.splitlines()
    return [line.removesuffix(END) for line in lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")]]


def test_decimals_stand_under_one_another_with_one_number_of_digits():
    text = tex_of(0.7, 0.70638, -1.25)
    assert r"\begin{tabular}{S[table-format=-1.4]}" in text
    assert cells(text) == ["0.7000", "0.7064", "-1.2500"]
    assert cells(tex_of(3, 12)) == ["3", "12"]


def test_numbers_that_differ_much_keep_as_many_digits_each():
    text = tex_of(1e5, 0.5, 2e-9, 0.0)
    assert r"\begin{tabular}{S[table-format=1.5e-1]}" in text
    assert cells(text) == ["1.0000e5", "0.50000", "2.0000e-9", "0"]


def test_packages_and_caption_come_first_and_a_head_of_numbers_is_no_number():
    begin = ["% \\usepackage{booktabs, siunitx}", r"\begin{table}", r"\centering", r"\caption{Periods.}"]
    text = tex_of(0.5)
    assert text.splitlines()[:4] == begin
    assert r"{period (s)} \\" in text


def test_what_is_no_number_is_kept_from_the_columns_layout():
    assert cells(tex_of(0.5, None, "walked")) == ["0.50000", "{--}", "{walked}"]
    assert r"\begin{tabular}{l}" in tex_of("walked", "fell")


def test_the_papers_tables_have_its_digits_its_words_and_a_caption():
    row = {"unit": "s", "paper_matlab": 0.6, "paper_matlab_text": "0.60", "corrected": 0.7036, "contact": 0.7111}
    text = as_tex(table_of("table3", {"t_left": row})).decode()
    assert r"\caption{Table 3: characteristics of the walk, in the paper and here." in text
    assert r"quantity & {paper, MATLAB} & {corrected} & {contact model} \\" in text
    assert r"left step period, $t_\mathrm{left}$ (s) & 0.60 & 0.70360 & 0.71110 \\" in text


def test_what_a_record_has_no_value_for_is_empty_in_a_file():
    assert as_csv(record_table([{"a": None, "b": 1.5}, {"a": "x", "b": 2.5}])) == b"a,b\n,1.5\nx,2.5\n"
