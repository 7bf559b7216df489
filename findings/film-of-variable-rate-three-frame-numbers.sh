#!/usr/bin/env bash
# Frame 30 of a phone's film is three pictures: the frames of a film with a variable rate depend on who reads it.
#
# What one would guess: a film of 90 frames has 90 frames, and frame k is the same picture whichever library reads it and
# whether it is read in turn or sought. At worst the times k / fps are a little off.
# What happens, in a film that goes from 30 to 15 frames/s and back as phones do in poor light:
#   OpenCV, in turn           90 frames, with the right times in CAP_PROP_POS_MSEC; k / CAP_PROP_FPS is off by 0.24 s
#   OpenCV, CAP_PROP_POS_FRAMES = 30     gives frame 35, because it seeks the time 30 / mean rate
#   imageio, plugin FFMPEG    134 frames: ffmpeg makes the rate constant and repeats frames; its frame 30 is frame 22
#   imageio, plugin pyav      90 frames in turn, but index=50 gives frame 36; it reports 30 frames/s, FFMPEG 20.3
# Digitised points that are joined to times by number are so wrong, and a foot at rest between repeated frames jumps.
# Instead: read in turn with OpenCV or PyAV and keep each frame's time, or convert to a constant rate first.
# Versions: opencv-python-headless 5.0.0.93, imageio 2.38.1, imageio-ffmpeg 0.8.1, av 18.1.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check opencv-python-headless==5.0.0.93 imageio==2.38.1 imageio-ffmpeg==0.8.1 \
    av==18.1.0 numpy==2.4.6
cat > film.py <<'EOF'
"""Films whose pictures show their own number as eight white or black blocks."""

from fractions import Fraction

import av
import cv2
import imageio.v3 as iio
import numpy as np

FILM = "walk.mp4"
COUNT = 90
intervals_ms = np.where(np.arange(COUNT) // 15 % 2 == 0, 33, 67)
TIMES_MS = np.concatenate([[0], np.cumsum(intervals_ms)[:-1]])


def write_film():
    with av.open(FILM, "w") as film:
        stream = film.add_stream("mpeg4", rate=1000)
        stream.width, stream.height, stream.pix_fmt = 320, 64, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        for number, time in enumerate(TIMES_MS):
            blocks = np.array([number >> bit & 1 for bit in range(8)], dtype=np.uint8) * 255
            picture = np.broadcast_to(np.repeat(blocks, 40)[None, :, None], (64, 320, 3))
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), "rgb24")
            frame.pts = int(time)
            frame.time_base = Fraction(1, 1000)
            film.mux(stream.encode(frame))
        film.mux(stream.encode())


def number_in(picture):
    return sum(int(picture[32, 40 * bit + 20, 0] > 128) << bit for bit in range(8))


def read_in_turn():
    film = cv2.VideoCapture(FILM)
    numbers = []
    times = []
    while True:
        is_read, picture = film.read()
        if not is_read:
            return numbers, np.array(times), film.get(cv2.CAP_PROP_FPS)
        numbers.append(number_in(picture))
        times.append(film.get(cv2.CAP_PROP_POS_MSEC))


def seek(index):
    film = cv2.VideoCapture(FILM)
    film.set(cv2.CAP_PROP_POS_FRAMES, index)
    return number_in(film.read()[1])


write_film()
numbers, times, rate = read_in_turn()
off_s = np.abs(np.arange(COUNT) / rate - TIMES_MS / 1000).max()
print(f"OpenCV {cv2.__version__} in turn: {len(numbers)} frames, times right to {np.abs(times - TIMES_MS).max():.1e} ms,")
print(f"    rate {rate:.1f} frames/s, number / rate is off by {off_s:.3f} s at most")
assert numbers == list(range(COUNT)) and np.allclose(times, TIMES_MS, atol=1), "behaviour has changed"
assert off_s > 0.2, "behaviour has changed"
sought = seek(30)
print(f"OpenCV, CAP_PROP_POS_FRAMES = 30: expected frame 30, actual frame {sought}")
assert sought == 35, "behaviour has changed"
repeated = [number_in(picture) for picture in iio.imread(FILM, plugin="FFMPEG")]
rate_ffmpeg = iio.immeta(FILM, plugin="FFMPEG")["fps"]
print(f"imageio, FFMPEG: expected 90 frames, actual {len(repeated)}; number 30 is frame {repeated[30]}; {rate_ffmpeg} frames/s")
assert len(repeated) > COUNT and set(repeated) == set(range(COUNT)) and repeated[30] != 30, "behaviour has changed"
in_turn = [number_in(picture) for picture in iio.imiter(FILM, plugin="pyav")]
by_index = number_in(iio.imread(FILM, plugin="pyav", index=50))
rate_pyav = iio.immeta(FILM, plugin="pyav")["fps"]
print(f"imageio, pyav: {len(in_turn)} frames in turn; index=50: expected frame 50, actual {by_index}; {rate_pyav} frames/s")
assert in_turn == list(range(COUNT)) and by_index == 36 and rate_pyav == 30, "behaviour has changed"
EOF
venv/bin/python film.py
