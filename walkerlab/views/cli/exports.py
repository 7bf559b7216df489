"""Export figures, tables, trajectories and models as files for other programs, and walks as GIF or MP4."""

import io
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config import problems, schema
from walkerlab.errors import ConfigError, StaleError, StorageError
from walkerlab.extensions import code_by_word, load
from walkerlab.labels import add_unit, join_words
from walkerlab.pipeline.plan import graph, resolve
from walkerlab.pipeline.plan.planner import Planner, command, refusing_older, results_in, results_to_show, the_result
from walkerlab.pipeline.plan.results import FolderResults
from walkerlab.pipeline.store import artifact, content, files, runs
from walkerlab.views.cli.console import Console
from walkerlab.views.cli.request import Request
from walkerlab.views.figures.style import EXPORT_DPI
from walkerlab.views.report.tables import Table, as_csv, record_table
from walkerlab.views.report.tex import COLUMN_WIDTHS, as_tex
from walkerlab.views.report.words import MODEL_NAMES

if TYPE_CHECKING:
    from walkerlab.views.figures.illustration import Illustration


@dataclass(frozen=True)
class Target:
    """File, format and size of an export."""

    to: str | None  # format, or file name if `output` is None
    output: Path | None  # file, or None to derive its name from the run
    inputs: tuple[Path, ...] = ()  # files that the command reads, which must not be overwritten
    columns: int = 1  # journal columns that a figure or a table for LaTeX spans
    width: float | None = None  # width (pt) of a figure; None for the width of `columns`
    dpi: int = EXPORT_DPI  # pixels per inch of a figure

    def choose_file(self, what: str, stem: str, kinds: Sequence[str]) -> tuple[Path, str]:
        """Return the file to write and its format, by default the first of `kinds`.

        what  the exported item, for messages
        stem  name of the file, without its ending, if the user named no file
        Raises ConfigError for an unknown format, or if the file must not be overwritten.
        """
        a_file = self.to is not None and self.output is None and "." in self.to
        output = Path(str(self.to)) if a_file else self.output
        ending = "" if output is None else output.suffix.removeprefix(".")
        kind = (None if a_file else self.to) or ending or kinds[0]
        if kind not in kinds:
            raise ConfigError(f"{what} cannot be written as {kind}.", f"--to {', '.join(kinds)}")
        if ending in kinds and ending != kind:
            raise ConfigError(f"--to {kind} contradicts the ending of {output}.", "Leave out --to, or rename the file.")
        path = output or Path(f"{stem}.{kind}")
        with files.storing(path):
            self.refuse(path, kind)
        return path, kind

    def refuse(self, path: Path, kind: str) -> None:
        """Raise ConfigError if the file is a folder, an input of the command, or a result of a run."""
        another = "Nothing was written; name another file with -o."
        if path.is_dir():
            raise ConfigError(f"{path} is a folder.", f"Name a file in it: -o {shlex.quote(f'{path}/NAME.{kind}')}")
        if path.exists() and any(file.exists() and path.samefile(file) for file in self.inputs):
            raise ConfigError(f"{path} is an input of this command.", another)
        if (owner := runs.owner_of(path, graph.PIPELINE.names)) is not None:
            raise ConfigError(f"{path} belongs to the results of the run {owner.path}.", another)


def write_file(path: Path, data: bytes, console: Console) -> Path:
    """Write a file, and warn if it replaces a file with different content.

    Raises StorageError if writing fails.
    """
    replaced = path.is_file() and path.read_bytes() != data
    try:
        files.write_through(path, data)
    except StorageError as error:
        raise StorageError(error.message, "Name another file with -o.") from error
    if replaced:
        console.warn(f"{path} existed and was replaced.")
    return path


FIGURE_KINDS = ("pdf", "svg", "png", "eps", "tiff")
TRAJECTORY_KINDS = ("csv", "nc")
DRAWING_KINDS = ("svg", "pdf", "png")
FILM_KINDS = ("gif", "mp4")
TABLES = {"table": "paper_numbers", "table-1": "table1", "table-2": "table2", "table-3": "table3"}
NOT_IN_NAMES = re.compile(r"[^a-z0-9]+")
TRAJECTORY = "trajectory"
STEPS = "steps"
OUTPUTS_ADVICE = "Run it with outputs: [states, energies, forces]."
"""Advice if a walk was stored without a trajectory."""
FIGURE_NUMBER = re.compile(r"(?:fig(?:ure)?[- .]*)?0*(\d+)")


def run_to_export(run: str, request: Request) -> runs.RunFolder:
    """Find a run, and warn if its config file has been edited since the run.

    Raises ConfigError if there is no such run.
    """
    folder = runs.run_named(run, request.runs)
    resolve.warn_of_edits(runs.config_of(folder), folder, request.console.warn)
    return folder


def export_from(folder: runs.RunFolder, what: str, target: Target, model: str, console: Console) -> Path:
    """Write an item of a run to a file and return its path.

    Raises ConfigError for an unknown item or format, StaleError for a missing result.
    """
    if numbered := FIGURE_NUMBER.fullmatch(what):
        what = f"figure-{int(numbered[1]):02d}"
    make: Callable[[str], bytes]
    kinds: Sequence[str]
    writers: dict[str, Callable[[Table], bytes]] = {"csv": as_csv, "tex": partial(as_tex, columns=target.columns)}
    if what == TRAJECTORY:
        stem, kinds, make = f"{model}-{what}", TRAJECTORY_KINDS, lambda kind: trajectory(folder, model, kind, console)
    elif what == STEPS:
        stem, kinds, make = f"{model}-{what}", ("csv",), lambda _: steps_of_walk(folder, model, console)
    elif what in TABLES:
        stem, kinds, make = what, tuple(writers), lambda kind: writers[kind](table(folder, what, kind, console))
    elif isinstance(item := find_item(folder, what), Table):
        stem, kinds, make = hyphenate(what), tuple(writers), lambda kind: writers[kind](item)
    else:
        stem, kinds, make = what, FIGURE_KINDS, lambda kind: figure(folder, item, kind, target, console)
    path, kind = target.choose_file(what, f"{folder.name}-{stem}", kinds)
    return write_file(path, make(kind), console)


def draw_walker(config: Path, target: Target, console: Console) -> Path:
    """Draw the walker of a config with its dimensions.

    Raises ConfigError for an invalid config or unknown format.
    """
    # Imported here, because no other export draws a walker.
    from walkerlab.config.files import files_read, find_config
    from walkerlab.config.loader import load
    from walkerlab.views.figures.measures import draw_measures

    loaded = load(config, ())
    for warning in loaded.warnings:
        console.warn(warning)
    target = replace(target, inputs=tuple(files_read(find_config(config))))
    path, kind = target.choose_file("a walker", f"{loaded.run_name}-walker", DRAWING_KINDS)
    return write_file(path, draw_measures(loaded.config.walker, files.as_text(path.stem), kind), console)


def hyphenate(words: str) -> str:
    """Turn words into a file name: lower case, with hyphens."""
    return NOT_IN_NAMES.sub("-", words.lower().replace("'", "").replace("’", "")).strip("-")


def caption_name(caption: str) -> str:
    """Turn the words of a caption before the first comma or colon into a file name."""
    return hyphenate(re.split("[,:]", caption)[0])


def page_tables(folder: runs.RunFolder) -> dict[str, Table]:
    """Return the tables of a run's page by short caption or, if two tables share that, by full caption."""
    # Imported here, because exporting a figure needs no page.
    from walkerlab.views.report.blocks import Results
    from walkerlab.views.report.registry import pages_of

    planner = plan_run(folder)
    report = graph.PIPELINE["report"]
    results = Results(planner.config, planner.inputs(report), (), planner.missing_inputs(report))
    sections = [section for page in pages_of(results, folder.name) for section in page.sections]
    tables = [block for section in sections for block in section.blocks if isinstance(block, Table)]
    short = [caption_name(block.caption) for block in tables]
    alone = {name for name in short if name not in TABLES and short.count(name) == 1}
    return {name if name in alone else hyphenate(each.caption): each for name, each in zip(short, tables, strict=True)}


def find_item(folder: runs.RunFolder, name: str) -> "Illustration | Table":
    """Find a figure or table by name.

    Raises ConfigError for an unknown name. Its advice lists the items of the run.
    """
    # Imported here, because tables of the paper's values need no drawing code.
    from walkerlab.views.figures.stage import FIGURES

    figures = {illustration.name: illustration for illustration in FIGURES}
    if name in figures:
        return figures[name]
    tables = page_tables(folder)
    for called in (hyphenate(name), caption_name(name)):
        if called in tables:
            return tables[called]
    stored, _ = runs.read_all(folder, graph.PIPELINE.names)
    compared = stored["compare"].summary if "compare" in stored else {}
    names = [illustration.name for illustration in FIGURES if illustration.why_left_out(stored, {}) is None]
    names += [table for table, key in TABLES.items() if key in compared]
    names += tables
    names += [name for name in (STEPS, TRAJECTORY) if any(name in result.groups for result in stored.values())]
    nothing = f"{folder.path} has no results yet: {command(folder, graph.PIPELINE['report'])} computes them all."
    advice = "\n  ".join([f"Items of {folder.path}:", *names]) if names else nothing
    # A user who asks for a figure that does not exist did not mean the one with the most similar number.
    near = "" if name.startswith("figure-") else problems.suggestion(name, names)
    raise ConfigError(f"this run has no item {name}.{near}", advice)


def plan_run(folder: runs.RunFolder) -> Planner:
    """Return a planner with the run's current results, but without stages if the run's config is no longer valid."""
    config = runs.config_of(folder)
    stages = () if config is None else graph.PIPELINE.stages
    planner = Planner(config or schema.Config(), FolderResults(folder, elsewhere=False), stages)
    planner.plan()
    return planner


def figure(folder: runs.RunFolder, illustration: "Illustration", kind: str, target: Target, console: Console) -> bytes:
    """Draw a figure as on the page, but at the target's size, and return the file's bytes.

    Raises StaleError if its results are missing.
    """
    stored = results_in(folder, illustration.stages)
    run = plan_run(folder)
    plot = graph.PIPELINE["plot"]
    inputs = {name: result for name, result in run.inputs(plot).items() if isinstance(result, artifact.Stored)}
    available = inputs.keys() | run.left_out.keys()
    outdated, _ = runs.read_all(folder, (name for name in plot.results(run.config) if name not in available))
    with refusing_older(folder, outdated):
        reason = illustration.why_left_out(stored, {})
    if reason is not None:
        commands = [command(folder, graph.PIPELINE[stage]) for stage in illustration.stages if stage not in stored]
        advice = f"Run {join_words(commands)} first." if commands else ""
        raise StaleError(f"{illustration.name} cannot be drawn: {reason}.", advice)
    left_out = stored.keys() <= inputs.keys()
    if not left_out:
        inputs |= stored | {name: result for name, result in outdated.items() if result.complete}
    if outdated:
        console.warn(
            f"{folder.path} has outdated results, which are {'left out' if left_out else 'drawn anyway'}: "
            f"{join_words(sorted(outdated))}; {command(folder, graph.PIPELINE['report'])} recomputes them."
        )
    with refusing_older(folder, outdated):
        return illustration.as_file(inputs, kind, target.width or COLUMN_WIDTHS[target.columns], target.dpi)


def table(folder: runs.RunFolder, name: str, kind: str, console: Console) -> Table:
    """Return a table of the paper's values, as records (csv) or laid out as on the report's page (tex).

    Raises ConfigError for other walkers.
    """
    with results_to_show(folder, ["compare"], console.warn) as results:
        summary = the_result(results, folder, "compare").summary
    if TABLES[name] not in summary:
        raise ConfigError(
            f"{folder.path} has no {name}: that table is about the paper's walker, and this run has a different one.",
            f"The page of the run has {join_words(page_tables(folder))}.",
        )
    rows = summary[TABLES[name]]
    if kind == "tex":
        tex_table: Table = load(code_by_word("tables")["compare"])(TABLES[name], rows)
        return tex_table
    if isinstance(rows, Mapping):
        rows = [{"quantity": quantity, **row} for quantity, row in rows.items()]
    return record_table(rows)


def steps_of_walk(folder: runs.RunFolder, model: str, console: Console) -> bytes:
    """Return a CSV file of a walk's steps for `identify --level steps`.

    Raises StaleError if the walk takes no step.
    """
    with results_to_show(folder, [model], console.warn) as results:
        groups = the_result(results, folder, model).groups
    if STEPS not in groups:
        raise StaleError("the walk takes no step.", f"Run {model} from another start.")
    columns = {name: groups[STEPS][name] for name in ("period_s", "length_m")}
    if TRAJECTORY in groups and "angle" in groups[TRAJECTORY].variables:
        columns["touch_angle_rad"] = touch_angles(groups[STEPS], groups[TRAJECTORY])
    return files.csv_text(list(columns), zip(*(values.tolist() for values in columns.values()), strict=True))


def touch_angles(steps: content.Group, trajectory: content.Group) -> NDArray[np.float64]:
    """Return the angle (steps,) in rad of the leg that touches down at the end of each step. Leg 1 touches first."""
    legs = [np.interp(steps["touch_time_s"], trajectory["time"], leg) for leg in trajectory["angle"].T]
    return np.asarray(np.where(np.arange(steps["touch_time_s"].size) % 2 == 0, *legs))


def trajectory(folder: runs.RunFolder, model: str, kind: str, console: Console) -> bytes:
    """Return a walk over time as CSV (a column per variable and leg) or netCDF.

    Raises StaleError if no trajectory is stored.
    """
    with results_to_show(folder, [model], console.warn) as results:
        stored = the_result(results, folder, model)
    if (group := stored.groups.get(TRAJECTORY)) is None:
        raise StaleError("the walk was stored without a trajectory.", OUTPUTS_ADVICE)
    if kind == "nc":
        # Imported here, because CSV needs no HDF5.
        from walkerlab.pipeline.store import hdf5

        attributes = {
            "title": f"walkerlab {stored.identity.stage}",
            "Conventions": hdf5.CONVENTIONS,
            "content_digest": stored.digest(),
        }
        return hdf5.image({"": group}, {**group.attrs, **attributes})
    columns = {}
    for name, variable in sorted(group.variables.items(), key=lambda named: (named[0] != "time", named[0])):
        if variable.dims == ("time",):
            columns[add_unit(name, variable.units)] = variable.values.tolist()
        elif variable.dims[:1] == ("time",):
            for place, values in enumerate(variable.values.T.tolist()):
                columns[add_unit(f"{name} {place + 1}", variable.units)] = values
    return files.csv_text(list(columns), zip(*columns.values(), strict=True))


def write_model(
    run: str, request: Request, target: Target, law: str | None = None, slope: str = "gravity"
) -> list[Path]:
    """Write a model of the walker of a run or config, and return the files written. A missing gait is computed first.

    run    run or config
    law    contact law in a model for ADAMS; None for its default
    slope  what is tilted in a model for MuJoCo: gravity, or the geometry

    Raises ConfigError for an unknown run or format, or if a format cannot express the walker, and NoAnswer if the
    walker has no gait.
    """
    # Imported here, because only models need a walker and its gait.
    from walkerlab.exchange.export import ENDINGS, export_model, parse_law, parse_slope
    from walkerlab.exchange.exported import GaitStart
    from walkerlab.pipeline.run.runner import Options, execute
    from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
    from walkerlab.pipeline.store.provenance import git_commit

    resolved = resolve.resolve(run, request.settings, runs=request.runs)
    console = request.console
    config = resolved.loaded.config
    folder = resolved.folder
    for warning in resolved.loaded.warnings:
        console.warn(warning)
    resolve.warn_of_edits(config, folder, console.warn)
    # MuJoCo's viewer opens only files that end in .xml.
    named_mjcf = target.output is not None and target.output.suffix == ".mjcf"
    to = "xml" if target.to == "mjcf" and not named_mjcf else target.to
    path, ending = replace(target, to=to).choose_file("a model", folder.name, list(ENDINGS))
    kind = ENDINGS[ending]
    adams_law = parse_law(law or "contact")
    if law is not None and kind == "mjcf":
        raise ConfigError("--law chooses between contact laws of ADAMS.", "Leave it out for MuJoCo.")
    inputs = {}
    if config.start == "fixed-point":
        report = execute(config, "fixedpoint", folder, Options(), console)
        if report.no_answer is not None:
            raise report.no_answer
        assert report.content is not None, "a stage with an answer stores it"
        inputs["fixedpoint"] = report.content
    start = GaitStart(*rigid_start(config, inputs), step_asymmetry(config, inputs))
    exported = export_model(config, start, kind, adams_law, git_commit(), path.stem, parse_slope(slope))
    for omission in exported.left_out:
        console.note(f"left out: {omission}")
    paths = [path, *(path.with_name(name) for name in list(exported.files)[1:])]
    for extra in paths[1:]:
        target.refuse(extra, extra.suffix.removeprefix("."))
    return [write_file(file, text.encode(), console) for file, text in zip(paths, exported.files.values(), strict=True)]


@dataclass(frozen=True)
class Film:
    """Options of an animation."""

    model: str  # stage whose walk is shown, or BOTH
    steps: int | None  # number of steps shown, from the first; None lets `film_times` choose
    rate: int  # frames per second
    slower: float  # slow-motion factor


BOTH = "both"
"""Value of `Film.model` for both models in one picture."""
MAX_GIF_RATE = 50
"""Maximum frame rate (frames per second). Browsers stretch a frame shorter than 20 ms to 100 ms."""


def walk_in(folder: runs.RunFolder, model: str | None = None) -> str:
    """Return `model`. If it is None, choose contact-sim, or simulate if only that has run.

    Raises ConfigError if the stage `model` simulates no walk.
    """
    if model is not None and model not in MODEL_NAMES:
        names = ", ".join(MODEL_NAMES)
        raise ConfigError(f"--model {model} is not a stage that simulates a walk.", f"Choose from {names}.")
    rigid, contact = MODEL_NAMES
    alone = folder.artifact(rigid).is_file() and not folder.artifact(contact).is_file()
    return model or (rigid if alone else contact)


def write_film(folder: runs.RunFolder, target: Target, film: Film, console: Console) -> Path:
    """Draw a run's walk and write the animation.

    Raises ConfigError for an unknown format, StaleError if no walk can be drawn, StorageError if writing fails.
    """
    path, kind = target.choose_file("an animation", f"{folder.name}-{film.model}", FILM_KINDS)
    ffmpeg = shutil.which("ffmpeg")
    if kind == "mp4" and ffmpeg is None:
        raise ConfigError("an MP4 needs ffmpeg, which is not installed.", "Install it, or write a .gif.")
    if kind == "gif" and film.rate > MAX_GIF_RATE:
        message = f"browsers slow down GIFs with more than {MAX_GIF_RATE} frames per second."
        raise ConfigError(message, "Lower --rate, or use .mp4.")
    # Imported here, so that a user whose file cannot be written need not wait for the drawing code.
    from walkerlab.views.figures.stick_diagram import FILM_NEEDS, film_times, pictures, read_sticks

    rigid, contact = MODEL_NAMES
    shown, *behind = [contact, rigid] if film.model == BOTH else [film.model]
    with results_to_show(folder, [shown, *behind], console.warn) as results:
        walk, *others = (the_result(results, folder, model) for model in (shown, *behind))
        for model in (shown, *behind):
            if (reason := FILM_NEEDS[model].missing_in(results, {})) is not None:
                raise StaleError(f"the walk cannot be drawn: {reason}.", OUTPUTS_ADVICE)
        sticks = read_sticks(walk)
        other = read_sticks(others[0]) if others else None
        times = film_times(sticks, film.steps, film.rate, film.slower)
        line = console.begin("animate", f"{times.size} pictures")
        line.start("drawing", int(times.size))

        def count_pictures() -> Iterator[Any]:
            for picture in pictures(sticks, times, walk.groups.get("terrain"), other):
                yield picture
                line.advance()

        data = gif(count_pictures(), film.rate) if kind == "gif" else mp4(count_pictures(), film.rate, str(ffmpeg))
        line.end("")
    return write_file(path, data, console)


def gif(pictures: Iterable[Any], rate: int) -> bytes:
    """Encode the pictures as an endlessly looping GIF."""
    from PIL import Image

    frames = [Image.fromarray(picture).quantize(64) for picture in pictures]
    # A GIF counts hundredths of a second. The times at which frames end are rounded, because the errors of rounded
    # durations would add up over the film.
    durations_ms = 10 * np.diff(np.round(100 * np.arange(len(frames) + 1) / rate)).astype(int)
    file = io.BytesIO()
    frames[0].save(file, format="GIF", save_all=True, append_images=frames[1:], duration=durations_ms.tolist(), loop=0)
    return file.getvalue()


def mp4(pictures: Iterable[Any], rate: int, ffmpeg: str) -> bytes:
    """Encode the pictures as an MP4 for browsers and slides.

    Raises StorageError if ffmpeg fails.
    """
    frames = list(pictures)
    height, width, _ = frames[0].shape
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(rate), "-i", "-"]
    # Many players show only yuv420p. The MP4 is fragmented, because ffmpeg cannot seek back in a pipe to write the
    # index of an ordinary MP4.
    coded = ["-pix_fmt", "yuv420p", "-movflags", "frag_keyframe+empty_moov", "-f", "mp4", "-"]
    command = [ffmpeg, "-loglevel", "error", *raw, *coded]
    done = subprocess.run(command, input=b"".join(map(bytes, frames)), capture_output=True, check=False)
    if done.returncode:
        raise StorageError(f"ffmpeg failed: {done.stderr.decode(errors='replace').strip()}", "Write a .gif instead.")
    return done.stdout
