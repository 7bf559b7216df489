"""Maps made piece by piece: what a run that was cut off has left is not computed again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from walkerlab.pipeline.progress import Progress
from walkerlab.store.parts import Numbers, Parts
from walkerlab.workers import in_order


class Piece(NamedTuple):
    """Some cells of a map that are computed at once.

    name   under which their numbers are kept
    cells  how many
    run    computes the numbers
    """

    name: str
    cells: int
    run: Callable[[], Numbers]


def complete(
    pieces: Sequence[Piece],
    parts: Parts,
    label: str,
    progress: Progress,
    jobs: int,
    shared_from: int = 0,
    first: Sequence[int] = (0,),
) -> tuple[list[Numbers], int]:
    """Compute the pieces that are not there yet, and keep each as soon as it is.

    parts        what an earlier run has left, and where new pieces are kept
    jobs         processes
    shared_from  cells that take longer than starting another process
    first        places of pieces that are done here, before several processes would each compile the same

    Returns the numbers of each piece, and how many cells were computed.
    """
    waiting = [piece for piece in pieces if piece.name not in parts.kept]
    cells = sum(piece.cells for piece in waiting)
    total = sum(piece.cells for piece in pieces)
    progress.start(label, total)
    progress.advance(total - cells)
    found = in_order([piece.run for piece in waiting], jobs if cells >= shared_from else 1, first)
    for piece, numbers in zip(waiting, found, strict=True):
        parts.keep(piece.name, numbers)
        progress.advance(piece.cells)
    return [parts.kept[piece.name] for piece in pieces], cells
