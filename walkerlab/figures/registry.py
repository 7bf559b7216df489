"""The illustrations there are, in the order in which they are shown."""

from walkerlab.figures import costs, families, ground, maps, robustness, stick_diagram, walks
from walkerlab.figures.illustration import Illustration

NUMBERED = (*stick_diagram.FIGURES, *walks.FIGURES, *maps.FIGURES, *families.FIGURES, *robustness.FIGURES)
FIGURES: tuple[Illustration, ...] = (
    *sorted((costs.FIGURE_12, *NUMBERED), key=lambda figure: figure.name),
    *ground.FIGURES,
    *costs.FIGURES,
    *maps.STABILITY,
)
