"""Draw the pictures of docs/walkers.md and of the tutorial: the dimensions of each type of walker, and leg angles.

The command `walkerlab draw` draws the dimensions of your own walker.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.patches import Arc

from walkerlab.config.loader import load
from walkerlab.views.figures.canvas import blank, figure_style, files_of
from walkerlab.views.figures.measures import draw_measures
from walkerlab.views.figures.style import BLACK, BLUE, GREEN, GREY, PALE, VERMILLION

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
PAGE = ROOT / "docs" / "walkers.md"
EXAMPLE = re.compile(r"```yaml\n(?:# .*\n)?((?:.*\n)*?name: (.*)\n(?:.*\n)*?)```")
# Names of the pictures, and the config of the page that each one shows.
PICTURES = {
    "compass": "my-compass",
    "straight-legs": "my-feet",
    "torso": "my-torso",
    "kneed": "my-knees",
    "parts": "own-parts",
}


def pictures() -> dict[str, bytes]:
    """Draw the configs of docs/walkers.md and the leg angles. Return the pictures by file name."""
    with tempfile.TemporaryDirectory() as folder:
        for config, name in EXAMPLE.findall(PAGE.read_text(encoding="utf-8")):
            (Path(folder) / f"{name}.yaml").write_text(config, encoding="utf-8")
        walkers = {name: load(Path(folder) / f"{config}.yaml", ()).config.walker for name, config in PICTURES.items()}
    drawn = {f"walker-{name}.svg": draw_measures(walker, name) for name, walker in walkers.items()}
    return {**drawn, "walker-angles.svg": draw_angles()}


def draw_angles(swing: float = -0.42, stance: float = 0.22) -> bytes:
    """Draw a compass walker just after a heel strike, with both leg angles (rad) from the vertical."""
    slope = -0.5 * (swing + stance)
    with figure_style():
        figure = blank(2.6)
        axes = figure.add_subplot()
        axes.set_axis_off()
        axes.set(aspect="equal", xlim=(-1.5, 1.1), ylim=(-0.2, 1.25))
        ground = np.array([-1.5, 1.1])
        axes.fill_between(ground, -0.2, -np.tan(slope) * ground, facecolor=PALE, edgecolor="none")
        axes.plot(ground, -np.tan(slope) * ground, color=BLACK, linewidth=0.8)
        hip = np.array([-np.sin(stance), np.cos(stance)])
        axes.plot([hip[0], hip[0]], [hip[1], hip[1] - 1.1], color=GREY, linewidth=0.8, linestyle="--")
        for angle, radius, colour, name in ((swing, 0.55, VERMILLION, "θ₁"), (stance, 0.7, BLUE, "θ₂")):
            foot = hip + np.array([np.sin(angle), -np.cos(angle)])
            axes.plot(*np.transpose([hip, foot]), color=colour, linewidth=2.5)
            axes.plot(*(0.5 * (hip + foot)), "o", markersize=9, color=GREEN, zorder=3)
            turned = np.degrees(sorted([angle, 0.0])) - 90.0
            axes.add_patch(Arc(hip, 2 * radius, 2 * radius, theta1=turned[0], theta2=turned[1], color=colour))
            middle = hip + 1.1 * radius * np.array([np.sin(0.5 * angle), -np.cos(0.5 * angle)])
            axes.text(*middle, name, color=colour, ha="center", va="center")
        axes.plot(*hip, "o", markersize=13, color=GREEN, zorder=3)
        axes.text(hip[0] - 0.72, 0.42, "swing leg: θ₁ < 0", color=VERMILLION, ha="right")
        axes.text(hip[0] + 0.35, 0.42, "stance leg: θ₂ > 0", color=BLUE)
        axes.annotate("", xy=(0.95, 1.1), xytext=(0.45, 1.1), arrowprops={"arrowstyle": "-|>"})
        axes.text(0.7, 1.15, "walking direction", ha="center")
        return files_of(figure, "angles", "Leg angles of the compass walker from the vertical", ["svg"])[0]


if __name__ == "__main__":
    for name, picture in pictures().items():
        (IMAGES / name).write_bytes(picture)
