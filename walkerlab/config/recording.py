"""The recording block: a walk measured or computed elsewhere, to compare with. `identify` shares its keys."""

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from walkerlab.config.fields import Block, Text, check_against, key

Tilt = Annotated[
    Annotated[Literal["floor", "free"], Tag("word")] | Annotated[float, Field(ge=-45.0, le=45.0), Tag("number")],
    Discriminator(lambda value: "word" if isinstance(value, str) else "number"),
]


class Recorded(Block):
    """Properties of a recorded walk that its file does not state."""

    columns: dict[Text, Text] = key(
        dict,
        "",
        "column of each quantity that the header does not identify; -NAME changes the sign, NAME+90deg adds a constant",
        bounds="a column for each quantity",
    )
    units: dict[Text, Text] = key(
        dict,
        "",
        "units by kind (angle, length, ...), quantity or column",
        bounds="a unit for each kind, quantity or column",
    )
    walks: Literal["left", "right", "away", "towards"] | None = key(
        None,
        "",
        "direction of the walk in the recording; right is along the first horizontal axis of the markers",
        default_in_words="the one in which swinging feet move",
    )
    camera_tilt_deg: Tilt | None = key(
        None,
        "deg",
        "how far the direction from which angles are measured leans forward from the vertical; "
        "floor: as far as the floor's normal, free: find it from the recording",
        bounds="-45 to 45, floor, free",
        default_in_words="0, or floor if the program that wrote the file levels the floor",
    )
    belt_speed_m_s: float | None = key(
        None,
        "m/s",
        "speed of the treadmill's belt, from which step lengths are computed",
        gt=0.0,
        le=1e3,
        default_in_words="no belt",
    )
    fps: float | None = key(
        None,
        "1/s",
        "frames per second of the film, for files that count frames or whose times assume another frame rate",
        ge=1e-3,
        le=1e7,
        default_in_words="times as in the file",
    )
    from_s: float | None = key(
        None, "s", "time from which the recording is read", bounds="any number", default_in_words="the first sample"
    )
    to_s: float | None = key(
        None,
        "s",
        "time up to which the recording is read",
        bounds="any number greater than from_s",
        default_in_words="the last sample",
    )
    min_likelihood: float | None = key(
        None,
        "1",
        "likelihood of a marker below which its position counts as missing",
        ge=0.0,
        le=1.0,
        default_in_words="none",
    )

    _span = check_against(
        "to_s", "from_s", lambda end, begin: "" if end is None or end > begin else "is not after from_s"
    )


class RecordedFile(Recorded):
    """File with a walk for `walkerlab compare --with`, and the meaning of its columns."""

    file: Text = key(
        "",
        "",
        "file with the walk: CSV, ADAMS, OpenSim, markers, or a stored walk of a run",
        bounds="a path, relative to the current folder",
        default_in_words="none",
    )
    name: Text = key(
        "",
        "",
        "name of the walk in figures and tables",
        bounds="any text",
        default_in_words="file name without extension",
    )
