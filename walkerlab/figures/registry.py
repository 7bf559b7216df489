"""All illustrations in display order, including those that evidence registers."""

from walkerlab.figures import families, ground, maps, robustness, stick_diagram, walks
from walkerlab.figures.illustration import Illustration
from walkerlab.registration import registered

NUMBERED = (*stick_diagram.FIGURES, *walks.FIGURES, *maps.FIGURES, *families.FIGURES, *robustness.FIGURES)
FIGURES: tuple[Illustration, ...] = (
    *sorted((*registered("walkerlab.paper.figures", "FIGURES"), *NUMBERED), key=lambda figure: figure.name),
    *ground.FIGURES,
    *registered("walkerlab.benchmarks.figures", "FIGURES"),
    *maps.STABILITY,
)
