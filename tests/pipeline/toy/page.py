"""Write one page."""

from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import write_atomically


def run(config, inputs, progress, folder, left_out):
    page = folder / "report.html"
    said = "".join(f"<p>{entry.what}: {entry.why}</p>" for entry in left_out)
    write_atomically(page, f"<html>{sorted(inputs)}{said}</html>".encode())
    return Content({artifact.FILES_GROUP: artifact.index_files(folder, [page])}, {"html": "report.html"})
