"""JSON values as text for people."""

from walkerlab.cli.text import described_summary, table
from walkerlab.report.tables import LONGEST_CELL

SENTENCES = "One gait cycle of the rigid model, to scale. " * 5


def test_a_column_of_sentences_is_named_below_the_table_and_not_in_it():
    rows = [{"number": 2, "svg": "figures/figure-02.svg", "caption": SENTENCES}, {"svg": "own.svg", "caption": "-"}]
    lines = list(described_summary({"figures": rows}))
    assert lines[1].split() == ["number", "svg"]
    assert lines[2].split() == ["2", "figures/figure-02.svg"]
    assert lines[-1].strip() == "with --json also: caption"
    assert max(map(len, lines)) < LONGEST_CELL


def test_a_table_of_sentences_alone_is_shown():
    assert table([{"caption": SENTENCES}])[1] == SENTENCES.rstrip()
