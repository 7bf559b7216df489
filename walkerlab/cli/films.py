"""`walkerlab animate`: a walk as GIF, or as MP4 where ffmpeg is found."""

import io
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.cli.console import Console
from walkerlab.cli.exports import STORED_WITH, Target, put
from walkerlab.errors import ConfigError, StaleError, StorageError
from walkerlab.pipeline.runs import result_in
from walkerlab.report.outcomes import MODELS
from walkerlab.store.runfolder import RunFolder

KINDS = ("gif", "mp4")


@dataclass(frozen=True)
class Film:
    """What is shown.

    model   the stage whose walk it is
    steps   how many of its steps
    rate    pictures a second
    slower  so many times slower than life
    """

    model: str
    steps: int
    rate: int
    slower: float


def walk_in(folder: RunFolder, model: str | None = None) -> str:
    """The stage whose walk is meant: if none is named the contact model's before the rigid model's.

    Raises ConfigError if the one that is named does not walk.
    """
    if model is not None and model not in MODELS:
        raise ConfigError(f"--model {model}: not a walk.", f"There are {', '.join(MODELS)}.")
    rigid, contact = MODELS
    alone = folder.artifact(rigid).is_file() and not folder.artifact(contact).is_file()
    return model or (rigid if alone else contact)


def write_film(folder: RunFolder, target: Target, film: Film, console: Console) -> Path:
    """Draw a run's walk, picture by picture, and write the film.

    Raises ConfigError for a format that there is not, StaleError if there is no walk to draw, StorageError.
    """
    path, kind = target.of("an animation", f"{folder.name}-{film.model}", KINDS)
    ffmpeg = shutil.which("ffmpeg")
    if kind == "mp4" and ffmpeg is None:
        raise ConfigError("an MP4 needs ffmpeg, which is not installed.", "Install it, or write a .gif.")
    # Imported here: what cannot be written is told before anything is loaded that draws.
    from walkerlab.figures.stick_diagram import OF_STAGE, film_times, pictures, sticks_of

    results = {film.model: result_in(folder, film.model)}
    why = OF_STAGE[film.model].why_left_out(results, {})
    if why is not None:
        raise StaleError(f"the walk cannot be drawn: {why}.", STORED_WITH)
    sticks = sticks_of(results[film.model])
    at = film_times(sticks, film.steps, film.rate, film.slower)
    line = console.begin("animate", f"{at.size} pictures")
    line.start("drawing", int(at.size))

    def told() -> Iterator[Any]:
        for picture in pictures(sticks, at, results[film.model].groups.get("terrain")):
            yield picture
            line.advance()

    data = gif(told(), film.rate) if kind == "gif" else mp4(told(), film.rate, str(ffmpeg))
    line.end("")
    return put(path, data, console)


def gif(drawn: Iterable[Any], rate: int) -> bytes:
    """The pictures as a GIF that goes round and round."""
    from PIL import Image

    frames = [Image.fromarray(picture).quantize(64) for picture in drawn]
    file = io.BytesIO()
    frames[0].save(file, format="GIF", save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0)
    return file.getvalue()


def mp4(drawn: Iterable[Any], rate: int, ffmpeg: str) -> bytes:
    """The pictures as an MP4 that browsers and slides play; StorageError if ffmpeg fails."""
    frames = list(drawn)
    height, width, _ = frames[0].shape
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(rate), "-i", "-"]
    coded = ["-pix_fmt", "yuv420p", "-movflags", "frag_keyframe+empty_moov", "-f", "mp4", "-"]
    command = [ffmpeg, "-loglevel", "error", *raw, *coded]
    done = subprocess.run(command, input=b"".join(map(bytes, frames)), capture_output=True, check=False)
    if done.returncode:
        raise StorageError(f"ffmpeg failed: {done.stderr.decode(errors='replace').strip()}", "Write a .gif instead.")
    return done.stdout
