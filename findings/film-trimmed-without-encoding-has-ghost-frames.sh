#!/usr/bin/env bash
# A film that was trimmed without encoding it anew: imageio returns pictures that nobody filmed at its end.
#
# What one would guess: a film trimmed from 90 to 75 frames has 75 frames in every reader. If the file still holds the frames that
# were cut off (a copy must begin at a key frame, so they stay and a list of edits hides them), a reader gives 75 or 90.
# What happens: all readers hide the same 15 frames at the beginning, but the *number* of frames is that of the file:
#   imageio.v3.imread, pyav   an array of 90 pictures; the last 15 were never written, so they may be black or noise
#   imageio.v3.improps, pyav  90, PyAV's stream.frames too; imageio.v3.imiter and PyAV give 75
#   OpenCV                    CAP_PROP_FRAME_COUNT is 90; 75 are read. Frame 80 is sought without an error, and is not there
# A duration of 90 / 30 s is 20 % too long, and frame k of the tracked film is frame k + 15 of the uncut one.
# Instead: read in turn until there are no more frames, and count those; or encode anew when trimming.
# Versions: imageio 2.38.1, av 18.1.0, opencv-python-headless 5.0.0.93, imageio-ffmpeg 0.8.1, numpy 2.4.6, November 2026.
# Source: imageio issues 1005 (a film with 806 frames by number and 752 in turn) and 932 (the array is allocated by that number).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check opencv-python-headless==5.0.0.93 av==18.1.0 imageio==2.38.1 \
    imageio-ffmpeg==0.8.1 numpy==2.4.6
cat > trim.py <<'EOF'
import subprocess
from importlib.metadata import version

import av
import cv2
import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np

FRAMES = 90
KEPT = 75
print({name: version(name) for name in ("imageio", "av", "opencv-python-headless", "imageio-ffmpeg", "numpy")})
writer = imageio_ffmpeg.write_frames(
    "whole.mp4", (160, 96), fps=30, codec="libx264", output_params=["-g", "30", "-crf", "10"]
)
writer.send(None)
for frame in range(FRAMES):
    writer.send(np.full((96, 160, 3), 40 + 2 * frame, np.uint8))
writer.close()
program = imageio_ffmpeg.get_ffmpeg_exe()
subprocess.run([program, "-loglevel", "error", "-ss", "0.5", "-i", "whole.mp4", "-c", "copy", "trimmed.mp4"], check=True)


def number(picture):
    """Return the frame of the whole film that a picture shows."""
    return int(np.argmin(np.abs(brightness - picture.mean())))


brightness = np.array([picture.mean() for picture in iio.imiter("whole.mp4", plugin="pyav")])
pictures = iio.imread("trimmed.mp4", plugin="pyav")
in_turn = list(iio.imiter("trimmed.mp4", plugin="pyav"))
with av.open("trimmed.mp4") as container:
    stated = container.streams.video[0].frames
    decoded = sum(1 for _ in container.decode(video=0))
capture = cv2.VideoCapture("trimmed.mp4")
counted = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
read = 0
while capture.read()[0]:
    read += 1
capture = cv2.VideoCapture("trimmed.mp4")
capture.set(cv2.CAP_PROP_POS_FRAMES, 80)
is_read, _ = capture.read()
print(f"expected: {KEPT} frames, the first of which is frame {FRAMES - KEPT} of the whole film")
print(f"imageio.imread: {len(pictures)}; mean brightness of the last {len(pictures) - KEPT}: {pictures[KEPT:].mean((1, 2, 3))}")
print(f"imageio.improps: {iio.improps('trimmed.mp4', plugin='pyav').shape[0]}; imiter: {len(in_turn)}")
print(f"PyAV: {stated} stated, {decoded} decoded; OpenCV: {counted} counted, {read} read, frame 80 read: {is_read}")
print(f"first frame: {number(pictures[0])}, last frame in turn: {number(in_turn[-1])}")
assert len(pictures) == stated == counted == iio.improps("trimmed.mp4", plugin="pyav").shape[0] == FRAMES, "behaviour has changed"
assert len(in_turn) == decoded == read == KEPT, "behaviour has changed"
assert (pictures[:KEPT] == np.array(in_turn)).all(), "behaviour has changed"
assert number(in_turn[0]) == FRAMES - KEPT and number(in_turn[-1]) == FRAMES - 1, "behaviour has changed"
EOF
venv/bin/python trim.py
