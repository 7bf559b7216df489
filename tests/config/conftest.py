"""Fixtures of the config tests: a folder for configs, and the message with which a config is rejected."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from walkerlab.config.loader import LoadedConfig, load
from walkerlab.errors import ConfigError

Write = Callable[[str], Path]
Refused = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write_config(text: str, name: str = "mine.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write_config


@pytest.fixture
def loaded(write: Write) -> Callable[..., LoadedConfig]:
    def load_text(text: str, sets: Sequence[str] = ()) -> LoadedConfig:
        return load(write(text), sets)

    return load_text


@pytest.fixture
def refused(write: Write) -> Refused:
    """Load a text and return the message with which it is rejected. The path of the file is shortened to its name."""

    def refuse(text: str = "name: mine\n", sets: Sequence[str] = ()) -> str:
        path = write(text)
        with pytest.raises(ConfigError) as caught:
            load(path, sets)
        return caught.value.message.replace(str(path), path.name)

    return refuse
