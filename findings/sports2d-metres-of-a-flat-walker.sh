#!/usr/bin/env bash
# Sports2D's metres are no scaled picture: each marker is moved to the depth of a human joint, whatever was filmed.
#
# What one would guess: with a level floor and a camera that looks square at it, metres are pixels times one factor, so a
# leg that is rigid in the picture is rigid in the .trc, and a vertical line stays vertical.
# What happens: unless `visible_side = 'none'`, X and Y of each keypoint are corrected for perspective with the depth
# that this joint has in a person (`marker_Z_positions` in Pose2Sim's common.py). For a flat thing that walks past, the
# thigh of one leg leans forwards and that of the other backwards by an angle that changes along the picture, here
# by 0.6 degrees from one side to the other, and both legs differ. `visible_side = 'none'` keeps the picture.
# Version: Sports2D 0.8.34 (convert_px_to_meters in process.py), Pose2Sim 0.10.49.
# The whole program runs here, on a film of black frames with given positions in pixels (`load_trc_px`).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps sports2d==0.8.34 pose2sim==0.10.49 rtmlib==0.0.16
# only what the import needs: no window toolkit, no pose models
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.2.6 pandas==2.3.3 \
    opencv-python-headless==4.12.0.88 matplotlib==3.11.2 scipy==1.17.1 statsmodels==0.15.0 filterpy==2.0.0 \
    anytree==2.13.0 tqdm==4.70.1 toml==0.10.2 rtoml==0.14.0 av==18.1.0 c3d==0.6.0 lxml==6.1.3 onnxruntime==1.32.0
cd "$folder"
venv/bin/python -W ignore - 2> "$folder/log" <<'PYTHON' || { tail -n 20 "$folder/log"; exit 1; }
import copy
import sys
from contextlib import redirect_stdout
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from Sports2D import Sports2D
from Sports2D.process import make_trc_with_trc_data

FPS, COUNT, WIDTH, HEIGHT, SCALE = 60, 300, 1600, 900, 300.0  # frames/s, frames, px, px, px/m
RAMP = 0.0
TIME = np.arange(COUNT) / FPS


def walker(side):
    """Return the positions in pixels (y downwards) of a walk on a level floor; thighs hang along the plumb line."""
    strides = [(TIME / 0.7 + leg) / 2.0 for leg in (0, 1)]
    feet = [0.8 * (np.floor(s) + np.clip(2.0 * (s - np.floor(s)) - 1.0, 0.0, 1.0)) - 0.4 for s in strides]
    begin = 150.0 if side > 0 else WIDTH - 150.0

    def place(along, height):
        return begin + side * SCALE * along * np.cos(RAMP), 500.0 + SCALE * (along * np.sin(RAMP) - height)

    body = np.mean(feet, axis=0)
    hip, neck = place(body, 0.85), place(body, 1.45)
    places = {"Hip": hip, "Neck": neck, "Head": (neck[0], neck[1] - 70.0), "Nose": (neck[0] + 15.0 * side, neck[1] - 40.0)}
    for foot, name in zip(feet, "RL"):
        ankle = place(foot, 0.0)
        places |= {f"{name}Hip": hip, f"{name}Knee": (hip[0], hip[1] + 0.4 * SCALE), f"{name}Ankle": ankle}
        places |= {f"{name}{part}": (ankle[0] + side * ahead, ankle[1] + 5.0)
                   for part, ahead in (("Heel", -10.0), ("BigToe", 40.0), ("SmallToe", 35.0))}
        shoulder = place(body, 1.4)
        places |= {f"{name}{part}": (shoulder[0], shoulder[1] + below)
                   for part, below in (("Shoulder", 0.0), ("Elbow", 80.0), ("Wrist", 150.0))}
    return places


film = cv2.VideoWriter("film.mp4", cv2.VideoWriter_fourcc(*"mp4v"), FPS, (WIDTH, HEIGHT))
for _ in range(COUNT):
    film.write(np.zeros((HEIGHT, WIDTH, 3), np.uint8))
film.release()
seen = {}
print("sports2d", version("sports2d"))
columns = [pd.DataFrame(np.c_[x, y, 0.0 * x], columns=[key] * 3) for key, (x, y) in walker(1.0).items()]
make_trc_with_trc_data(pd.concat([pd.Series(TIME, name="time"), *columns], axis=1), "film_px.trc", fps=FPS)
for visible_side in ("auto", "none"):
    config = copy.deepcopy(Sports2D.DEFAULT_CONFIG)
    config["base"] |= {
        "video_input": ["film.mp4"], "load_trc_px": "film_px.trc", "result_dir": visible_side,
        "visible_side": [visible_side], "nb_persons_to_detect": 1, "person_ordering_method": "greatest_displacement",
        "first_person_height": 1.7, "show_realtime_results": False, "save_vid": False, "save_img": False,
    }
    config["post-processing"] |= {"show_graphs": False, "save_graphs": False}
    Path(visible_side).mkdir()
    with redirect_stdout(sys.stderr):
        Sports2D.process(config)
    lines = next(Path(visible_side).rglob("*_m_person00.trc")).read_text().splitlines()
    names = lines[3].split("\t")
    rows = np.array([[float(cell or "nan") for cell in line.split("\t")] for line in lines[5:]])
    for leg in "RL":
        hip, knee = (rows[20:-20, names.index(leg + part) :][:, :2] for part in ("Hip", "Knee"))
        lean = np.degrees(np.arctan2(*(knee - hip).T * [[1.0], [-1.0]]))
        seen[visible_side, leg] = lean[0], lean[-1]
        print(f"visible_side {visible_side}: vertical thigh {leg} leans by {lean[0]:.2f} degrees at the beginning, "
              f"{lean[-1]:.2f} at the end (expected 0 and 0)")
moved = [abs(end - begin) for (side, _), (begin, end) in seen.items() if side == "auto"]
flat = [abs(value) for (side, _), pair in seen.items() if side == "none" for value in pair]
as_described = min(moved) > 0.3 and max(flat) < 0.01
sys.exit(0 if as_described else "The behaviour has changed.")
PYTHON
echo "As described."
