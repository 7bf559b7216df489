#!/usr/bin/env bash
# A table in DeepLabCut's form that sleap-io writes has empty likelihoods, although the predictions have scores.
#
# What one would guess: save_csv(format="dlc", include_score=True) writes each point's score in the column `likelihood`,
# since its own form ("sleap") has the scores; so a filter such as likelihood > 0.6 drops the unlikely points.
# What happens: the column is there and empty. A filter of that kind drops every point, and `not (likelihood < 0.6)`
# keeps every point. The first column holds paths of pictures (labeled-data/video/img0010.png), as DeepLabCut writes
# for labels made by hand, instead of the frame numbers that it writes for predictions.
# Version: sleap-io 0.9.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check sleap-io==0.9.5 pandas==2.3.3 numpy==2.2.6
cd "$folder"
venv/bin/python -W ignore - <<'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import pandas as pd
import sleap_io as sio

print("sleap-io", version("sleap-io"))
skeleton, video = sio.Skeleton(["hip", "foot"]), sio.Video.from_filename("film.mp4")
scores = np.array([0.9, 0.1])
frames = [
    sio.LabeledFrame(video=video, frame_idx=10 * n, instances=[
        sio.PredictedInstance.from_numpy(np.full((2, 2), float(n)), skeleton=skeleton, point_scores=scores, score=0.9)
    ])
    for n in range(3)
]
for form in ("sleap", "dlc"):
    sio.save_csv(sio.Labels(frames), f"{form}.csv", format=form, include_score=True)
own = pd.read_csv("sleap.csv")["foot.score"]
table = pd.read_csv("dlc.csv", header=[0, 1, 2], index_col=0)
likelihood = table.xs("likelihood", axis=1, level=2)
print("scores of the foot in the form 'sleap':", own.tolist())
print("likelihoods in the form 'dlc':", likelihood.to_numpy().tolist(), "(expected: [[0.9, 0.1], ...])")
print("index:", table.index.tolist(), "(expected: [0, 10, 20])")
as_described = (
    np.allclose(own, 0.1) and likelihood.isna().to_numpy().all() and table.index[1] == "labeled-data/video/img0010.png"
)
sys.exit(0 if as_described else "The behaviour has changed.")
PYTHON
echo "As described."
