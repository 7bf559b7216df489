"""`walkerlab init`: write a commented config to start from."""

import json
import shlex
from pathlib import Path

from walkerlab.config.files import DEFAULT, builtin_names
from walkerlab.config.loader import load, safe_name
from walkerlab.config.problems import explain_missing_feature, suggestion
from walkerlab.config.reference import as_json_schema
from walkerlab.config.schema import QUESTIONS, Config
from walkerlab.config.writer import to_commented_yaml
from walkerlab.errors import ConfigError, StorageError
from walkerlab.pipeline.store.files import make_folder, write_atomically

SCHEMA = ".walkerlab-schema.json"


def write_config(file: Path, walker: str) -> str:
    """Write a walker's commented config and schema.

    Raises ConfigError for an unknown type, StorageError if writing fails.
    """
    config = load(Path(template(walker))).config
    if file.exists():
        raise StorageError(f"{file} already exists.", "Choose another name; nothing was overwritten.")
    default = Config()
    untouched = [name for name in QUESTIONS if getattr(config, name) == getattr(default, name)]
    renamed = config.model_copy(update={"name": safe_name(file.stem), "source": None})
    text = f"# yaml-language-server: $schema={SCHEMA}\n{to_commented_yaml(renamed, untouched)}"
    try:
        make_folder(file.parent)
        write_atomically(file.parent / SCHEMA, json.dumps(as_json_schema(), indent=1).encode() + b"\n")
        write_atomically(file, text.encode())
    except StorageError as error:
        reason = getattr(error.__cause__, "strerror", None) or error.message
        raise StorageError(
            f"{file} could not be written: {reason}.", "Choose a file in a writable folder with free space."
        ) from error
    return f"wrote {file}, with its schema next to it; next: `walkerlab report -c {shlex.quote(str(file))}`"


def template(walker: str) -> str:
    types: dict[str, str] = {}
    for name in (DEFAULT, *builtin_names()):
        types.setdefault(load(Path(name)).config.walker.type, name)
    choices = types | {name: name for name in builtin_names()}
    if walker not in choices:
        beyond = explain_missing_feature(walker)
        hint = f"; {beyond}." if beyond else f".{suggestion(walker, choices)}"
        raise ConfigError(f"there is no walker type {walker!r}{hint}", f"Choose from {', '.join(choices)}.")
    return choices[walker]
