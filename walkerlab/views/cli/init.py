"""`walkerlab init`: write a commented config to start from."""

import json
import shlex
from pathlib import Path
from typing import Final

from walkerlab.config import files, loader, problems, reference, schema, writer
from walkerlab.errors import ConfigError, StorageError
from walkerlab.pipeline.store.files import make_folder, write_atomically

SCHEMA = ".walkerlab-schema.json"
PRINTED_WITH_GAITS: Final = ("name", "walker", "gravity_m_s2", "slope_rad")
CHECK_TO_FILL_IN: Final = """
check:                               # a printed gait; `walkerlab check` says whether it is right, and if not, why
  source: {title: null, authors: null, year: null, where: null}
  angles:
    from: vertical                   # or slope-normal
    second: absolute                 # or relative: swing leg minus stance leg
    unit: rad                        # or deg
    order: [swing, stance]           # as the source lists them
    layout: angles-first             # or interleaved: angle, rate, angle, rate
  instant: after-strike              # or before-strike, mid-stance
  printed:                           # as printed, because its digits count; null for what is not printed
    state: null                      # [angle, angle, rate, rate], such as [-0.2042, 0.1694, -0.6058, -0.8610]
    period_s: null
    step_length_m: null
    multipliers: null                # such as [0.62, -0.19+0.56i]
"""


def write_config(file: Path, walker: str, checks: bool = False) -> str:
    """Write a walker's commented config and the schema. If `checks` is true, the config is short and has a printed gait
    to fill in.

    Raises ConfigError for an unknown type, StorageError if writing fails.
    """
    builtin = template(walker)
    config = loader.load(Path(builtin)).config
    if file.exists():
        raise StorageError(f"{file} already exists.", "Choose another name; nothing was overwritten.")
    default = schema.Config()
    untouched = [name for name in schema.QUESTIONS if getattr(config, name) == getattr(default, name)]
    renamed = config.model_copy(update={"name": loader.safe_name(file.stem), "source": None})
    text = f"# yaml-language-server: $schema={SCHEMA}\n"
    if checks:
        text += f"extends: {builtin}\n{writer.commented_keys(renamed, PRINTED_WITH_GAITS)}{CHECK_TO_FILL_IN}"
    else:
        text += writer.to_commented_yaml(renamed, untouched)
    command = f"`walkerlab {'check' if checks else 'report -c'} {shlex.quote(str(file))}`"
    following = f"fill in what is printed, then {command}" if checks else command
    try:
        make_folder(file.parent)
        write_atomically(file.parent / SCHEMA, json.dumps(reference.as_json_schema(), indent=1).encode() + b"\n")
        write_atomically(file, text.encode())
    except StorageError as error:
        reason = getattr(error.__cause__, "strerror", None) or error.message
        message = f"{file} could not be written: {reason}."
        raise StorageError(message, "Choose a file in a writable folder with free space.") from error
    return f"wrote {file}, with its schema next to it; next: {following}"


def template(walker: str) -> str:
    types: dict[str, str] = {}
    for name in (files.DEFAULT, *files.builtin_names()):
        # Several built-in configs have walkers of the same type. The first of them is the template of the type.
        types.setdefault(loader.load(Path(name)).config.walker.type, name)
    choices = types | {name: name for name in files.builtin_names()}
    if walker not in choices:
        beyond = problems.explain_missing_feature(walker)
        hint = f"; {beyond}." if beyond else f".{problems.suggestion(walker, choices)}"
        raise ConfigError(f"there is no walker type {walker!r}{hint}", f"Choose from {', '.join(choices)}.")
    return choices[walker]
