"""Check that the downloads of docs/exchange.md are current and that its Python runs."""

import re
from pathlib import Path

import numpy as np
import pytest

import walkerlab

DOCS = Path(__file__).parents[2] / "docs"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


def python_blocks():
    return re.findall(r"^```python\n(.*?)^```$", (DOCS / "exchange.md").read_text(), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    for ending in ("adm", "cmd", "xml"):
        walkerlab.export_model(folder / f"paper.{ending}", name="paper", slope_rad=0.0174)
    return folder


@pytest.mark.parametrize("name", ["paper.adm", "paper.acf", "paper.cmd", "paper.xml"])
def test_downloads_equal_freshly_exported_models(folder, name):
    """The files are equal up to rounding, except for the line with the version."""
    texts = [
        re.sub(r".*Written by walkerlab.*", "", path.read_text()) for path in (DOCS / "downloads" / name, folder / name)
    ]
    before, now = (NUMBER.sub("#", text) for text in texts)
    assert before == now, "run: python scripts/refresh_docs.py --downloads"
    np.testing.assert_allclose(*(np.array(NUMBER.findall(text), float) for text in texts), rtol=1e-7, atol=1e-9)


def test_walker_walks_in_plain_mujoco_and_in_gymnasium(folder, monkeypatch, capsys):
    pytest.importorskip("mujoco")
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(folder)
    notebook, stepping, writing = python_blocks()
    names = {}
    page = (DOCS / "exchange.md").read_text(encoding="utf-8")
    exec(notebook, names)
    assert f"It prints `{capsys.readouterr().out.strip()}`" in page
    names["mujoco"].set_mjcb_control(None)
    exec(stepping, names)
    assert f"It prints `{capsys.readouterr().out.strip()}`" in page
    assert names["data"].qpos[1] > 0.9
    exec((DOCS / "examples" / "walker_env.py").read_text(), names)
    walker = names["Walker"]("paper.xml")
    first, _ = walker.reset(seed=1)
    rewards = []
    for _ in range(50):
        observation, reward, fallen, _, _ = walker.step(np.zeros(1))
        rewards.append(reward)
        assert not fallen
    assert observation.shape == first.shape == walker.observation_space.shape
    assert sum(rewards) > 0.3
    exec(writing, names)
    assert Path("heavy.acf").is_file()
