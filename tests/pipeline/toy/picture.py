"""Draw one figure that names the results from which it was drawn."""

from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import make_folder, write_atomically


def run(config, inputs, progress, folder, left_out):
    make_folder(folder / "figures")
    figure = folder / "figures" / "figure-01.svg"
    write_atomically(figure, f"<svg>{sorted(inputs)} without {[entry.what for entry in left_out]}</svg>".encode())
    return Content(
        {artifact.FILES_GROUP: artifact.index_files(folder, [figure])}, {"figures": ["figures/figure-01.svg"]}
    )
