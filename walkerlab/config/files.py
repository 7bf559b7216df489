"""Find and read config files, written by users or built in, and merge the layers of a config: files and `--set`."""

import contextlib
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from walkerlab.config.problems import KEYS_ARE_LISTED, explain_missing_feature, nearest, printable, problem_error
from walkerlab.config.reader import MAX_CHARACTERS, MAX_DEPTH, read
from walkerlab.config.tree import BlockNode, ListNode, Node, Position, Scalar

_INSTALLED: Final = Path(__file__).parent / "builtin"
BUILTIN_FOLDER: Final = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[2] / "configs"
"""Folder of the built-in configs: next to this file in a wheel, otherwise at the top of the checkout."""
DEFAULT: Final = "paper"
SUFFIXES: Final = (".yaml", ".yml")
MAX_EXTENDS: Final = 16
SHOWN_PATH: Final = 240
STORED_IS_COMPLETE: Final = "every key with its value; a stored config extends nothing"
read_cached = lru_cache(maxsize=32)(read)  # safe to share, because callers change only copies of the trees


@dataclass(frozen=True, slots=True)
class ConfigFile:
    """A config file, or a config that is stored with a run."""

    path: Path  # path of the file; for a run, the name of its folder
    label: str  # name used in messages
    text: str | None = None  # config stored with a run or artifact; None to read the file
    changes: tuple[str, ...] = ()  # KEY=VALUE settings that made the run's config from its file


def is_file(path: Path) -> bool:
    """Whether a path is a file. Return False for a path that the system refuses, such as one that is too long."""
    with contextlib.suppress(OSError):
        return path.is_file()
    return False


def builtin_names() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in BUILTIN_FOLDER.glob("*.yaml")))


def config_to_extend(typed: str | None) -> str:
    """Return the config that a new one extends: `typed` if it is a file or a built-in name, otherwise the paper's."""
    return typed if typed is not None and is_config(typed) else DEFAULT


def is_config(typed: str) -> bool:
    """Whether a text names a built-in config, or a file that is not an artifact."""
    return typed in builtin_names() or (is_file(Path(typed)) and Path(typed).suffix != ".h5")


def builtin_config(name: str) -> ConfigFile:
    return ConfigFile(BUILTIN_FOLDER / f"{name}.yaml", f"built-in {name}.yaml")


PUBLISHED: Final = Path("published")
"""Folder of the built-in configs of published gaits."""


def find_config(path: Path | None) -> ConfigFile:
    """Find the config that `--config` names: an existing path, or the name of a built-in config or published gait.
    Without `--config`, return the paper's config."""
    if path is None:
        return builtin_config(DEFAULT)
    if not is_file(path):
        if str(path) in builtin_names():
            return builtin_config(str(path))
        if path.parent == PUBLISHED and is_file(BUILTIN_FOLDER / path):
            return ConfigFile(BUILTIN_FOLDER / path, f"built-in {path}")
    return file_at(path)


def file_at(path: Path) -> ConfigFile:
    return ConfigFile(path, printable(str(path), SHOWN_PATH))


def read_layers(file: ConfigFile) -> list[BlockNode]:
    """Read a config file and all files that it extends, directly or indirectly. The file itself comes last.

    Raises ConfigError if a file cannot be read, is not a block of keys, or extends itself, or if a stored config
    refers to another file.
    """
    layers = [
        replace_cases_file(root.copy_without("extends"), layer_file.path.parent)
        for layer_file, root in files_and_blocks(file)
    ]
    return layers[::-1]


def files_read(file: ConfigFile) -> list[Path]:
    """List the files that a config is read from: its file, the files it extends, and files with stability cases."""
    paths = []
    for layer_file, root in files_and_blocks(file):
        cases = cases_file(root, layer_file.path.parent)
        paths += [layer_file.path] + ([] if cases is None else [cases[0].path])
    return paths


def files_and_blocks(file: ConfigFile) -> Iterator[tuple[ConfigFile, BlockNode]]:
    """Yield a config file and its block of keys, then the same for each file it extends. Raises the errors of
    `read_layers`."""
    seen: list[str] = []
    reference: Position | None = None  # position of the file's name in the config that extends it
    while True:
        root = read_cached(_text_of(file, reference), file.label)
        if str(file.path.resolve()) in seen:
            raise problem_error(reference, f"extends: {file.label} extends itself")
        if len(seen) == MAX_EXTENDS:
            raise problem_error(reference, f"extends: more than {MAX_EXTENDS} files deep")
        seen.append(str(file.path.resolve()))
        if not isinstance(root, BlockNode):
            empty = root is None or (isinstance(root, Scalar) and root.value is None)
            fault = "is empty" if empty else f"holds a {'single value' if isinstance(root, Scalar) else 'list'}"
            start = root.position if root else Position(file.label, 1, 1)
            raise problem_error(start, f"the file {fault}", "a block of keys, e.g. `extends: paper`")
        if file.text is not None:
            _refuse_named_files(root)
        yield file, root
        extends = root.entries.get("extends")
        if extends is None:
            return
        reference = extends.position
        if not isinstance(extends, Scalar) or not isinstance(extends.value, str) or not extends.value:
            raise problem_error(reference, "extends: is not the name of a config", _describe_choices())
        is_builtin = extends.value in builtin_names()  # otherwise a path relative to the file's folder
        file = builtin_config(extends.value) if is_builtin else file_at(file.path.parent / extends.value)


def _refuse_named_files(root: BlockNode) -> None:
    """Raise ConfigError if a stored config names another file. Stored configs are complete and may be untrusted."""
    cases = cases_file(root, Path())
    places = [root.entries["extends"].position] if "extends" in root.entries else []
    places += [] if cases is None else [cases[1]]
    if places:
        raise problem_error(places[0], "a stored config refers to a file", STORED_IS_COMPLETE)


def cases_file(layer: BlockNode, folder: Path) -> tuple[ConfigFile, Position] | None:
    """Return the file that stability.cases names (relative to `folder`) and the position of the name, or None."""
    block = layer.entries.get("stability")
    file_name = block.entries.get("cases") if isinstance(block, BlockNode) else None
    if not isinstance(file_name, Scalar) or not isinstance(file_name.value, str):
        return None
    return file_at(folder / file_name.value), file_name.position


def replace_cases_file(layer: BlockNode, folder: Path) -> BlockNode:
    """Replace a file name under stability.cases (relative to `folder`) by the list of cases in that file.

    Raises ConfigError if the file cannot be read or holds no list.
    """
    located = cases_file(layer, folder)
    block = layer.entries.get("stability")
    if located is None or not isinstance(block, BlockNode):
        return layer
    file, position = located
    cases = read(_text_of(file, position, "a file that holds a list of cases"), file.label)
    if not isinstance(cases, ListNode):
        raise problem_error(Position(file.label, 1, 1), "the file does not hold a list", "a list of stability cases")
    result = layer.copy_without()
    inner = block.copy_without()
    inner.put("cases", cases, block.keys["cases"])
    result.put("stability", inner, layer.keys["stability"])
    return result


def _describe_choices() -> str:
    return f"a file, or one of {', '.join(builtin_names())}"


def _text_of(file: ConfigFile, reference: Position | None, purpose: str = "") -> str:
    # Only the error message uses `reference`, the position of the file's name, and `purpose`, the expected contents of
    # a file that is not a config.
    if file.text is not None:
        return file.text
    kind = "file" if purpose else "config"
    advice = KEYS_ARE_LISTED if purpose else "`walkerlab init` writes a config to start from"
    try:
        mode = file.path.stat().st_mode
        # Reading a pipe or a device might never end.
        if not stat.S_ISREG(mode):
            what = "a folder" if stat.S_ISDIR(mode) else "not a regular file"
            raise problem_error(reference, f"{kind} {file.label} is {what}", "a YAML file")
        with file.path.open("rb") as stream:
            # A character in UTF-8 has at most four bytes.
            data = stream.read(4 * MAX_CHARACTERS + 1)
    except FileNotFoundError:
        there_is = purpose or _describe_choices() if reference else f"a run, {_describe_choices()}"
        beyond = "" if purpose or file.path.suffix else explain_missing_feature(file.path.name)
        text = f"there is no {kind} {file.label}{f'; {beyond}' if beyond else ''}"
        raise problem_error(reference, text, there_is, "" if beyond else _suggest_name(file), advice) from None
    except (OSError, ValueError, RuntimeError) as error:  # ValueError: null byte in the name; RuntimeError: link loop
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise problem_error(reference, f"{kind} {file.label} cannot be read: {reason.lower()}", advice=advice) from None
    if len(data) > 4 * MAX_CHARACTERS:
        raise problem_error(Position(file.label, 1, 1), f"longer than {MAX_CHARACTERS} characters: not a config")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        lines = data[: error.start].split(b"\n")
        where = Position(file.label, len(lines), len(lines[-1].decode("utf-8")) + 1)
        raise problem_error(where, f"byte 0x{data[error.start]:02x} is not UTF-8: is it a text file?") from None


def _suggest_name(file: ConfigFile) -> str:
    """Suggest an existing file or built-in config for a missing one."""
    neighbours: list[str] = []
    with contextlib.suppress(OSError, ValueError):
        neighbours = [path.name for path in file.path.parent.iterdir() if path.suffix in SUFFIXES]
    match = nearest(file.path.name, neighbours)
    return printable(str(file.path.with_name(match)), SHOWN_PATH) if match else nearest(file.path.stem, builtin_names())


SLOPE_KEYS: Final = ("slope_rad", "slope_deg")


@dataclass(frozen=True, slots=True)
class ConfigSetting:
    """A `--set KEY=VALUE` option."""

    path: tuple[str, ...]  # parts of the dotted key
    value: Node  # parsed value, as a tree
    position: Position  # position of the key


def merge_layers(layers: Sequence[BlockNode]) -> BlockNode:
    """Merge layers into one block. Later layers override earlier ones, and only the last one sets the name.

    Raises ConfigError if a layer has more than one slope key.
    """
    merged = layers[0]
    _refuse_two_slopes(merged.keys)
    for layer in layers[1:]:
        _refuse_two_slopes(layer.keys)
        # A config that extends another one is another run, so it does not inherit the name.
        lower = merged.copy_without("name")
        # A slope in degrees replaces a slope in radians from a lower layer, and the other way round.
        if any(name in layer.entries for name in SLOPE_KEYS):
            lower = lower.copy_without(*SLOPE_KEYS)
        merged = _merge_blocks(lower, layer)
    return merged


def _merge_blocks(lower: BlockNode, upper: BlockNode) -> BlockNode:
    result = lower.copy_without()
    for name, node in upper.entries.items():
        below = lower.entries.get(name)
        if isinstance(below, BlockNode) and isinstance(node, BlockNode):
            node = _merge_blocks(below, node)
        result.put(name, node, upper.keys[name])
    return result


def _refuse_two_slopes(keys: dict[str, Position]) -> None:
    slopes = [(name, place) for name, place in keys.items() if name in SLOPE_KEYS]
    if len(slopes) == len(SLOPE_KEYS):
        (first, first_place), (second, second_place) = slopes
        where = f" at {first_place}" if first_place else ""
        raise problem_error(second_place, f"{second}: slope already set by {first}{where}", "only one of them")


def parse_setting(text: str) -> ConfigSetting:
    """Parse a `--set` option.

    Raises ConfigError if it is not KEY=VALUE with a YAML value.
    """
    # A text with an attribute `source` comes from an option other than --set, and messages must name that option.
    key, equals, value = text.partition("=")
    source = printable(getattr(text, "source", "")) or f"--set {printable(text)}"
    start = Position(source, 1, 1)
    path = tuple(part.strip() for part in key.split("."))
    if not equals or not all(path):
        raise problem_error(start, "is not of the form KEY=VALUE", "e.g. --set slope_deg=3")
    if len(path) > MAX_DEPTH:
        raise problem_error(start, f"nested deeper than {MAX_DEPTH} levels")
    column = len(key) + 2
    return ConfigSetting(path, read(value, source, column) or Scalar(Position(source, 1, column), None, ""), start)


def option_setting(key: str, value: int | str) -> ConfigSetting:
    position = Position(f"--{key} {printable(str(value))}", 1, 1)
    return ConfigSetting((key,), Scalar(position, value, str(value)), position)


def apply_settings(tree: BlockNode, settings: Sequence[ConfigSetting]) -> BlockNode:
    """Apply settings in order. Lists and blocks are replaced, not merged.

    Raises ConfigError if a key's parent is not a block.
    """
    _refuse_two_slopes({setting.path[0]: setting.position for setting in settings})
    copies: dict[int, BlockNode] = {}
    for setting in settings:
        if setting.path[0] in SLOPE_KEYS:
            tree = tree.copy_without(*SLOPE_KEYS)
        tree = _place_setting(tree, setting, 0, copies)
    return tree


def _place_setting(block: BlockNode, setting: ConfigSetting, depth: int, copies: dict[int, BlockNode]) -> BlockNode:
    """Return a copy of a block with a setting applied. `copies` holds, by id, the blocks that earlier settings
    copied."""
    result = copies.get(id(block)) or block.copy_without()
    copies[id(result)] = result
    name = setting.path[depth]
    if depth == len(setting.path) - 1:
        result.put(name, setting.value, setting.position)
        return result
    inner = block.entries.get(name)
    if inner is None or (isinstance(inner, Scalar) and inner.value is None):
        inner = BlockNode(setting.position)
    if not isinstance(inner, BlockNode):
        above = printable(".".join(setting.path[: depth + 1]))
        full_key = printable(".".join(setting.path))
        raise problem_error(setting.position, f"{full_key}: {above} is a value, not a block of keys")
    result.put(name, _place_setting(inner, setting, depth + 1, copies), block.keys.get(name, setting.position))
    return result
