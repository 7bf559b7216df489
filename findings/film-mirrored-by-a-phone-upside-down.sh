#!/usr/bin/env bash
# A film that a phone has mirrored: OpenCV turns it upside down, PyAV shows it unmirrored, ffmpeg mirrors it.
#
# What one would guess: OpenCV applies the orientation that a film states (CAP_PROP_ORIENTATION_AUTO, its default), as ffmpeg and
# players do, and PyAV hands it out as an angle, frame.rotation. At worst a reader shows the pictures as they are stored.
# What happens: phones store the pictures of a mirrored front camera as they are, with a matrix that mirrors them. OpenCV and PyAV
# know only the angle of a matrix, and that formula gives 180 degrees for a mirror. A walker who is upright and goes to the right:
#   imageio, plugin FFMPEG   upright, to the right, as in players
#   PyAV, plugin pyav        upright, to the left, as stored; frame.rotation is -180, and who applies it gets OpenCV's picture
#   OpenCV                   upside down, to the right: gravity points upwards
# Of a phone held upright, so that the matrix mirrors and turns, OpenCV shows the mirror image of what players show, and PyAV the
# picture on its side. Nothing is printed.
# Instead: `ffmpeg -i film.mp4 upright.mp4` before tracking, which applies the matrix to the pictures; then all read alike.
# Versions: opencv-python-headless 5.0.0.93, av 18.1.0, imageio 2.38.1, imageio-ffmpeg 0.8.1, numpy 2.4.6, November 2026.
# Source: Apple's page on AVCaptureConnection.isVideoMirrored (movie files are mirrored by their track matrix); issue 1361 of
# javacv (one such film, three pictures in three browsers).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check opencv-python-headless==5.0.0.93 av==18.1.0 imageio==2.38.1 \
    imageio-ffmpeg==0.8.1 numpy==2.4.6
cat > mirror.py <<'EOF'
import subprocess
from importlib.metadata import version

import av
import cv2
import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np

WIDTH = 160
HEIGHT = 96
FRAMES = 12


def film():
    """Write a film of a hip, a white square above the middle that moves to the left as it is stored."""
    writer = imageio_ffmpeg.write_frames("stored.mp4", (WIDTH, HEIGHT), fps=30, codec="libx264")
    writer.send(None)
    for frame in range(FRAMES):
        picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        left = 120 - 8 * frame
        picture[10:30, left : left + 20] = 255
        writer.send(picture)
    writer.close()


def ffmpeg(*options):
    subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", *options], check=True)


def with_opencv(name):
    capture = cv2.VideoCapture(name)
    pictures = []
    while True:
        is_read, picture = capture.read()
        if not is_read:
            return pictures
        pictures.append(picture)


def with_pyav(name):
    with av.open(name) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def with_imageio(plugin):
    return lambda name: list(iio.imiter(name, plugin=plugin))


def walk(pictures):
    """Return where the hip is and which way it goes in the pictures."""
    places = []
    for picture in pictures:
        rows, columns = np.nonzero(picture[:, :, 0] > 128)
        places.append((rows.mean(), columns.mean()))
    height, width = pictures[0].shape[:2]
    (row, column), (last_row, last_column) = places[0], places[-1]
    if abs(last_row - row) > abs(last_column - column):
        side = "left" if column < width / 2 else "right"
        return f"at the {side}, " + ("downwards" if last_row > row else "upwards")
    side = "above" if row < height / 2 else "below"
    return f"{side}, to the " + ("right" if last_column > column else "left")


print({name: version(name) for name in ("opencv-python-headless", "av", "imageio", "imageio-ffmpeg")})
film()
ffmpeg("-display_rotation", "0", "-display_hflip", "-i", "stored.mp4", "-c", "copy", "mirrored.mp4")
ffmpeg("-display_rotation", "90", "-display_hflip", "-i", "stored.mp4", "-c", "copy", "turned.mp4")
ffmpeg("-i", "mirrored.mp4", "upright.mp4")
READERS = {
    "imageio, FFMPEG": with_imageio("FFMPEG"),
    "imageio, pyav": with_imageio("pyav"),
    "PyAV": with_pyav,
    "OpenCV": with_opencv,
}
EXPECTED = {
    "mirrored.mp4": ("above, to the right", "above, to the left", "above, to the left", "below, to the right"),
    "upright.mp4": ("above, to the right",) * 4,
    "turned.mp4": ("at the right, downwards", "above, to the left", "above, to the left", "at the left, downwards"),
}
for name, expected in EXPECTED.items():
    for (reader, read), expected_walk in zip(READERS.items(), expected, strict=True):
        actual = walk(read(name))
        print(f"{name:13s} {reader:16s} {actual}")
        assert actual == expected_walk, "behaviour has changed"
with av.open("mirrored.mp4") as container:
    rotation = next(container.decode(video=0)).rotation
print(f"PyAV's frame.rotation of the mirrored film: {rotation}")
assert abs(rotation) == 180, "behaviour has changed"
EOF
venv/bin/python mirror.py
