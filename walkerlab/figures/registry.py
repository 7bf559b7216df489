"""The illustrations there are, in the order in which they are shown."""

from __future__ import annotations

from walkerlab.figures import costs, families, ground, maps, stick_diagram, walk_figures
from walkerlab.figures.illustration import Illustration

NUMBERED = (*stick_diagram.FIGURES, *walk_figures.FIGURES, *maps.FIGURES, costs.FIGURE_12, *families.FIGURES)
FIGURES: tuple[Illustration, ...] = (
    *sorted(NUMBERED, key=lambda figure: figure.name),
    *ground.FIGURES,
    *costs.ACCURACY,
    *costs.ENGINES,
    *maps.STABILITY,
)
