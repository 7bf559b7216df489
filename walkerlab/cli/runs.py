"""Commands over whole runs."""

from __future__ import annotations

import typer

from walkerlab.stages.graph import Graph


def add_to(app: typer.Typer, graph: Graph) -> None:
    """Add the commands to a program for a pipeline."""
