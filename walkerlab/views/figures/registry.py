"""All illustrations in display order, including those that `walkerlab.evidence` registers."""

from walkerlab.registration import registered
from walkerlab.views.figures import (
    families,
    ground,
    identification,
    maps,
    measurement_plan,
    robustness,
    stick_diagram,
    walks,
)
from walkerlab.views.figures.illustration import Illustration

NUMBERED = (*stick_diagram.FIGURES, *walks.FIGURES, *maps.FIGURES, *families.FIGURES, *robustness.FIGURES)
FIGURES: tuple[Illustration, ...] = (
    *sorted((*registered("walkerlab.evidence.paper.figures", "FIGURES"), *NUMBERED), key=lambda figure: figure.name),
    *ground.FIGURES,
    *identification.FIGURES,
    *measurement_plan.FIGURES,
    *registered("walkerlab.evidence.benchmarks.figures", "FIGURES"),
    *maps.STABILITY,
)
