#!/usr/bin/env bash
# A GIF of matplotlib with 30 frames/s runs 11 % fast, and with 60 frames/s 67 %.
#
# What one would guess: FuncAnimation.save(..., PillowWriter(fps=30)) of 90 pictures lasts 3 s. A rate that GIF cannot hold
# is refused or rounded so that the whole lasts as long as it should, as ffmpeg does.
# What happens: PillowWriter cuts 33.3 ms to 33 ms, and Pillow cuts that to 3 hundredths of a second, GIF's unit, for each
# picture. A walk of 3 s lasts 2.7 s with 30 frames/s, 1.8 s with 60; with 120 each picture has no duration, which browsers
# show as 100 ms. Periods and speeds that are read off the film are wrong by the same factor.
# Right are 10, 20, 25, 50 and 100 frames/s. Instead: one of these, or a list of durations that sums up right in Pillow.
# Versions: matplotlib 3.11.2 (animation.py, PillowWriter.finish), pillow 13.0.0 (GifImagePlugin.py), November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check matplotlib==3.11.2 pillow==13.0.0 numpy==2.4.6
cat > film.py <<'EOF'
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import PIL
from matplotlib.animation import FuncAnimation, PillowWriter
from PIL import Image

DURATION_S = 3


def duration_as_saved(rate):
    figure, axes = plt.subplots(figsize=(1, 1))
    (line,) = axes.plot([0, 1], [0, 1])

    def draw(number):
        line.set_ydata([0, number / (DURATION_S * rate)])

    FuncAnimation(figure, draw, frames=DURATION_S * rate).save("walk.gif", writer=PillowWriter(fps=rate))
    plt.close(figure)
    with Image.open("walk.gif") as film:
        total = 0
        for number in range(film.n_frames):
            film.seek(number)
            total += film.info.get("duration", 0)
        assert film.n_frames == DURATION_S * rate
    return total / 1000


print(f"matplotlib {matplotlib.__version__}, pillow {PIL.__version__}: a film of {DURATION_S} s")
for rate, expected in ((25, 3.0), (30, 2.7), (50, 3.0), (60, 1.8), (120, 0.0)):
    actual = duration_as_saved(rate)
    print(f"{rate:3d} frames/s: expected 3.0 s, actual {actual:.1f} s")
    assert abs(actual - expected) < 0.005, "behaviour has changed"
EOF
venv/bin/python film.py
