"""Independent pieces of work, run here or in several processes, their results in order."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from typing import Protocol, TypeVar

R_co = TypeVar("R_co", covariant=True)
R = TypeVar("R")


class Piece(Protocol[R_co]):
    """Something to be computed; other processes can be sent it."""

    def run(self) -> R_co:
        """Its result."""


def run_piece(piece: Piece[R]) -> R:
    """One piece; a function that other processes can be sent."""
    return piece.run()


def in_order(pieces: Sequence[Piece[R]], jobs: int, first: Sequence[int] = ()) -> Iterator[R]:
    """The pieces' results in their order, whoever ran them.

    first  places of pieces that are run here before several processes would each compile the same
    """
    if jobs <= 1 or len(pieces) <= 1:
        yield from map(run_piece, pieces)
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    ready = {index: run_piece(pieces[index]) for index in first}
    waiting = [piece for index, piece in enumerate(pieces) if index not in ready]
    # compiled code and threads do not survive a fork
    with ProcessPoolExecutor(min(jobs, len(pieces)), get_context("spawn"), initializer=end_with_parent) as pool:
        others = pool.map(run_piece, waiting)
        for index in range(len(pieces)):
            yield ready[index] if index in ready else next(others)


def end_with_parent() -> None:
    """Have this process end when the one that sends it work was killed: it would wait for more for ever."""
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
