"""The recording block: a walk measured or computed elsewhere, to compare with."""

from typing import Any, Literal

from walkerlab.config.fields import Block, Text, key

Direction = Literal["left", "right", "away", "towards"]
WALKS: Any = key(
    None,
    "",
    "direction of a walk of markers, as the recording sees it; right is the first horizontal axis",
    default_in_words="the one in which swinging feet move",
)


class RecordedFile(Block):
    """File with a walk for `walkerlab compare --with`, and the meaning of its columns."""

    file: Text = key(
        "",
        "",
        "file with the walk: CSV, ADAMS, OpenSim, markers, or a stored walk of a run",
        bounds="a path, from the current folder",
        default_in_words="none",
    )
    name: Text = key(
        "",
        "",
        "name of the walk in figures and tables",
        bounds="any text",
        default_in_words="file name without extension",
    )
    columns: dict[Text, Text] = key(
        dict, "", "column of each quantity that the header does not identify", bounds="a column for each quantity"
    )
    units: dict[Text, Text] = key(
        dict,
        "",
        "units by kind (angle, length, ...), quantity or column",
        bounds="a unit for each kind, quantity or column",
    )
    walks: Direction | None = WALKS
