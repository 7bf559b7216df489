#!/usr/bin/env bash
# Sports2D takes the floor's angle off segment angles with the wrong sign if the walk goes to the left.
#
# What one would guess: `correct_segment_angles_with_floor_angle` makes segment angles relative to the floor, and a film
# seen in a mirror gives the same angles, because Sports2D flips a walk to the left ("takes into account which side the
# participant is facing").
# What happens: angles are computed in the flipped picture, but the floor's angle that is then subtracted is that of the
# picture as it is. A thigh that hangs along the plumb line on a 3 degree downward ramp gets -87 degrees in a walk to the
# right (right: it leans by 3 degrees off the floor's normal) and -93 degrees in the same walk to the left. Angles of
# a walk to the left are so wrong by twice the floor's angle. Its .trc in metres is right in both.
# Version: Sports2D 0.8.34 (`all_frames_angles_person_filt[ang_name] -= np.degrees(floor_angle_estim)` in process.py).
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
import io
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
RAMP = np.radians(3.0)
TIME = np.arange(COUNT) / FPS


def walker(side):
    """Return the positions in pixels (y downwards) of a walk down a ramp; thighs hang along the plumb line."""
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
for name, side in (("right", 1.0), ("left", -1.0)):
    columns = [pd.DataFrame(np.c_[x, y, 0.0 * x], columns=[key] * 3) for key, (x, y) in walker(side).items()]
    make_trc_with_trc_data(pd.concat([pd.Series(TIME, name="time"), *columns], axis=1), f"{name}_px.trc", fps=FPS)
    config = copy.deepcopy(Sports2D.DEFAULT_CONFIG)
    config["base"] |= {
        "video_input": ["film.mp4"], "load_trc_px": f"{name}_px.trc", "result_dir": name, "visible_side": ["auto"],
        "nb_persons_to_detect": 1, "person_ordering_method": "greatest_displacement", "first_person_height": 1.7,
        "show_realtime_results": False, "save_vid": False, "save_img": False,
    }
    config["post-processing"] |= {"show_graphs": False, "save_graphs": False}
    Path(name).mkdir()
    with redirect_stdout(sys.stderr):
        Sports2D.process(config)
    table = next(Path(name).rglob("*angles_person00.mot")).read_text().split("endheader\n")[1]
    seen[name] = float(pd.read_csv(io.StringIO(table), sep="\t")["right thigh"].median())
    print(f"walk to the {name}: right thigh {seen[name]:.2f} degrees (expected -87.00 in both)")
as_described = abs(seen["right"] + 87.0) < 0.1 and abs(seen["left"] + 93.0) < 0.1
sys.exit(0 if as_described else "The behaviour has changed.")
PYTHON
echo "As described."
