"""The illustrations there are, in the order in which they are shown: one file and one entry each."""

from __future__ import annotations

from walkerlab.figures import (
    accuracy,
    engines,
    figure_02,
    figure_05,
    figure_06,
    figure_07,
    figure_08,
    figure_09,
    figure_10,
    figure_11,
    figure_12,
    figure_13,
    figure_14,
    figure_15,
    figure_16,
    stability_maps,
)
from walkerlab.figures.illustration import Illustration

FIGURES: tuple[Illustration, ...] = (
    figure_02.FIGURE,
    figure_05.FIGURE,
    figure_06.FIGURE,
    figure_07.FIGURE,
    figure_08.FIGURE,
    figure_09.FIGURE,
    figure_10.FIGURE,
    figure_11.FIGURE,
    figure_12.FIGURE,
    figure_13.FIGURE,
    figure_14.FIGURE,
    figure_15.FIGURE,
    figure_16.FIGURE,
    *accuracy.FIGURES,
    *engines.FIGURES,
    *stability_maps.FIGURES,
)
