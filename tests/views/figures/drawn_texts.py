"""Find the texts of a figure as the renderer draws them, and where they are."""

import pytest
from matplotlib.text import Text


def texts_drawn(figure):
    """Return every text that the renderer receives, with its bounding box."""
    seen, draw = [], Text.draw

    def noted(text, renderer):
        if text.get_visible() and text.get_text().strip():
            seen.append((text, Text.get_window_extent(text, renderer)))
        draw(text, renderer)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", noted)
        figure.draw_without_rendering()
    return seen
