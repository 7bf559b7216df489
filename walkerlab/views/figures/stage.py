"""The `plot` stage: draw every figure whose results are available, as SVG and PNG.

`FIGURES` lists all figures in display order: first those with a figure number from the paper, then the others,
including those of extensions.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from walkerlab.config.reads import NamedConfig
from walkerlab.extensions import extensions, load
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store import artifact, content
from walkerlab.pipeline.store.files import make_folder, storing, write_atomically
from walkerlab.pipeline.store.runs import FIGURES_FOLDER
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.figures import families, identification, maps, robustness, stick_diagram, walks
from walkerlab.views.figures.illustration import Illustration

ADDED: tuple[Illustration, ...] = tuple(
    figure for extension in extensions().values() if extension.figures for figure in load(extension.figures)
)
NUMBERED = (*stick_diagram.FIGURES, *walks.FIGURES, *maps.FIGURES, *families.FIGURES, *robustness.FIGURES, *ADDED)
FIGURES: tuple[Illustration, ...] = (
    *sorted((figure for figure in NUMBERED if figure.number is not None), key=lambda figure: figure.name),
    *walks.GROUND,
    *identification.FIGURES,
    *(figure for figure in ADDED if figure.number is None),
    *maps.STABILITY,
)


def run(
    _config: NamedConfig,
    inputs: Mapping[str, artifact.Stored],
    progress: Progress,
    folder: Path,
    left_out: Sequence[LeftOut] = (),
    early: content.Content | None = None,
) -> content.Content:
    """Draw all figures whose results are available, and store them in the run's folder.

    left_out  results that are missing, with reasons
    early     figures that this run has already drawn, each as soon as its results were there

    Raises StorageError if a figure cannot be stored.
    """
    finished = {} if early is None else {entry["svg"]: entry for entry in early.summary["figures"]}
    absent = {entry.what: entry.why for entry in left_out}
    reasons = [figure.why_left_out(inputs, absent) for figure in FIGURES]
    progress.start("plot", reasons.count(None))
    drawn = []
    missing = []
    for figure, reason in zip(FIGURES, reasons, strict=True):
        if reason is None:
            drawn.append(finished.get(paths_of(figure.name)["svg"]) or draw(figure, inputs, folder))
            progress.advance()
        else:
            # Files of the figure may be left over from results that no longer exist.
            for path in paths_of(figure.name).values():
                with storing(folder / path):
                    (folder / path).unlink(missing_ok=True)
            # A figure of a stage that runs only on request is not reported as missing, because nobody asked for it.
            if not any(PIPELINE[name].on_demand and name not in inputs for name in figure.stages):
                missing.append({"what": figure.reference, "why": reason})
    files = [folder / str(entry[kind]) for entry in drawn for kind in ("svg", "png")]
    # The texts count as timings, because some captions quote run times, which differ from run to run.
    summary = {"figures": drawn, "left_out": missing}
    return content.Content({artifact.FILES_GROUP: artifact.index_files(folder, files)}, summary, timed=("figures",))


def draw(
    figure: Illustration, results: Mapping[str, artifact.Identified], folder: Path, name: str = ""
) -> dict[str, str | int | list[str]]:
    """Draw a figure, store it, and return its texts and the paths of its files relative to the run's folder.

    name  name of the files without suffix; default: the name of the figure
    """
    drawing = figure.render(results)
    paths = paths_of(name or figure.name)
    make_folder(folder / FIGURES_FOLDER)
    write_atomically(folder / paths["svg"], drawing.svg)
    write_atomically(folder / paths["png"], drawing.png)
    number = {} if figure.number is None else {"number": figure.number}
    words = {"title": figure.title, "caption": drawing.caption, "alt": figure.say("seen")}
    return {**number, **words, **paths, "results": list(figure.stages)}


def draw_at_once(stage: str, result: artifact.Identified, folder: Path, anew: bool) -> list[Path]:
    """Draw the figures that need only the result of `stage`, and return the paths of all SVG files.

    anew  whether to redraw figures that exist
    """
    results = {stage: result}
    figures = [figure for figure in FIGURES if figure.stages == (stage,) and figure.why_left_out(results, {}) is None]
    for figure in figures:
        if anew or not all((folder / path).is_file() for path in paths_of(figure.name).values()):
            draw(figure, results, folder)
    return [folder / paths_of(figure.name)["svg"] for figure in figures]


def paths_of(name: str) -> dict[str, str]:
    """Return the paths of a figure's files by kind, relative to the run's folder."""
    return {kind: f"{FIGURES_FOLDER}/{name}.{kind}" for kind in ("svg", "png")}
