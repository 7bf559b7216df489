"""Draw docs/images/mujoco.png: an exported walker at five instants of a walk, in MuJoCo's own renderer.

Usage: MUJOCO_GL=egl python scripts/mujoco_picture.py [FILE]; needs the extra `engines`.
"""

import sys
import tempfile
from pathlib import Path

import matplotlib.image
import mujoco
import numpy as np

import walkerlab

INSTANTS_S = (0.0, 0.2, 0.4, 0.6, 0.8)
HEIGHT, WIDTH = 340, 260


def main(file: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, *_ = walkerlab.export_model(Path(folder) / "walker.xml", name="paper", strides=2)
        model = mujoco.MjModel.from_xml_path(str(path))
    model.vis.global_.offwidth, model.vis.global_.offheight = WIDTH, HEIGHT
    model.vis.headlight.ambient[:] = 0.5
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation, camera.distance = 90.0, -8.0, 1.6
    renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
    pictures = []
    for instant in INSTANTS_S:
        while data.time < instant:
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        camera.lookat[:] = data.subtree_com[1] - (0.0, 0.0, 0.2)
        renderer.update_scene(data, camera)
        picture = renderer.render().copy()
        picture[(picture == 0).all(axis=2)] = 255  # The renderer leaves the background black.
        pictures.append(picture)
    matplotlib.image.imsave(file, np.concatenate(pictures, axis=1))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images/mujoco.png"))
