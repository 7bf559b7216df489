"""All illustrations in display order: first those numbered as in the paper, then the others, with extensions last."""

from walkerlab.extensions import extensions, load
from walkerlab.views.figures import families, ground, identification, maps, robustness, stick_diagram, walks
from walkerlab.views.figures.illustration import Illustration

ADDED: tuple[Illustration, ...] = tuple(
    figure for extension in extensions().values() if extension.figures for figure in load(extension.figures)
)
NUMBERED = (*stick_diagram.FIGURES, *walks.FIGURES, *maps.FIGURES, *families.FIGURES, *robustness.FIGURES, *ADDED)
FIGURES: tuple[Illustration, ...] = (
    *sorted((figure for figure in NUMBERED if figure.number is not None), key=lambda figure: figure.name),
    *ground.FIGURES,
    *identification.FIGURES,
    *(figure for figure in ADDED if figure.number is None),
    *maps.STABILITY,
)
