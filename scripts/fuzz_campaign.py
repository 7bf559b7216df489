"""Load fuzzed configs and damaged results, and check for tracebacks, hangs and NaNs in stored results.

    python scripts/fuzz_campaign.py                          # 2,000 configs, 200 damaged results
    python scripts/fuzz_campaign.py --configs 50 --damaged 20

Half of the configs are built-in ones, mutated byte by byte, line by line and value by value. The other half are drawn
key by key by hypothesis. Each is loaded, and some are also simulated, by the rigid or the contact model. Damaged
results are cut short, have flipped bits, are partly overwritten, are other files, or are altered and sealed again, with
other shapes, numbers or versions, hostile attributes, or ten gigabytes declared. The script prints a table in Markdown,
and exits with 1 if anything is wrong.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
from damage import WAYS
from hypothesis import strategies as st

from walkerlab.config.files import BUILTIN_FOLDER
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.errors import WalkerlabError
from walkerlab.pipeline.run.runner import Options, execute
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.runs import RunFolder

LONGEST_S = 20.0  # maximum time in which a config must be refused or simulated once its models are compiled
HANGS_S = 300.0  # After this time the campaign ends, with a traceback that shows where it hangs.
WALKED, WALKED_ON_GROUND = 4, 8  # every 4th config is simulated, every 8th with the contact model
TOLD_EVERY = 100
WORDS = (
    b"nan", b".nan", b".inf", b"-1", b"0", b"1e308", b"-1e-308", b"1e-14", b"null", b"[]", b"{}", b"true", b"'", b'"',
    b"&a", b"*a", b"!!python/object:os.system", b"../../x", b"<script>", b"\xff\xfe", b"\x00", b"? ", b"- ", b": ",
    b"99999999999999999999", b"0x10", b"1_000", b"extends: paper", b"strides: 1", b"\t", b"\r", b"---", b"%YAML 1.1",
)  # fmt: skip
Mutation = Callable[[random.Random, bytearray], None]


def change_byte(drawn: random.Random, text: bytearray) -> None:
    """Change a byte."""
    text[drawn.randrange(len(text))] = drawn.randrange(256)


def delete_piece(drawn: random.Random, text: bytearray) -> None:
    """Delete a piece."""
    start = drawn.randrange(len(text))
    del text[start : start + drawn.randrange(1, 40)]


def repeat_line(drawn: random.Random, text: bytearray) -> None:
    """Repeat or move a line."""
    lines = text.splitlines(keepends=True)
    lines.insert(drawn.randrange(len(lines)), drawn.choice(lines))
    text[:] = b"".join(lines)


def insert_word(drawn: random.Random, text: bytearray) -> None:
    """Insert a troublesome word."""
    at = drawn.randrange(len(text))
    text[at:at] = drawn.choice(WORDS)


def replace_value(drawn: random.Random, text: bytearray) -> None:
    """Replace the value of a key."""
    lines = text.splitlines()
    at = drawn.randrange(len(lines))
    name, colon, _ = bytes(lines[at]).partition(b":")
    lines[at] = bytearray(name + colon + b" " + drawn.choice(WORDS))
    text[:] = b"\n".join(lines) + b"\n"


def scale_number(drawn: random.Random, text: bytearray) -> None:
    """Change a number to one of another magnitude, which is more often valid than not."""
    lines = text.splitlines()
    numbered = [i for i, line in enumerate(lines) if b": " in line and line.partition(b": ")[2][:1].isdigit()]
    if numbered:
        at = drawn.choice(numbered)
        name = bytes(lines[at]).partition(b":")[0]
        lines[at] = bytearray(name + b": %.3g" % (10.0 ** drawn.uniform(-6.0, 6.0)))
        text[:] = b"\n".join(lines) + b"\n"


MUTATIONS: tuple[Mutation, ...] = (change_byte, delete_piece, repeat_line, insert_word, replace_value, scale_number)


def fuzzed(drawn: random.Random, texts: list[bytes]) -> bytes:
    """Mutate a built-in config one to four times."""
    text = bytearray(drawn.choice(texts))
    for _ in range(drawn.randrange(1, 5)):
        if text:
            drawn.choice(MUTATIONS)(drawn, text)
    return bytes(text)


def configs() -> st.SearchStrategy[bytes]:
    """Change a few keys of a built-in config to arbitrary values, or to values close to the present ones."""
    usual = dict(leaves_of(load(None).config.model_dump(mode="json"), ()))
    words = st.sampled_from([word.decode("latin-1") for word in WORDS])
    anything = st.one_of(st.floats(), st.integers(), st.booleans(), st.none(), words, st.text(), st.lists(st.floats()))

    def value_of(path: tuple[str, ...]) -> st.SearchStrategy[Any]:
        value = usual[path]
        if isinstance(value, bool) or not isinstance(value, int | float):
            return st.just(value) | anything
        scaled = st.floats(0.1, 10.0).map(lambda factor: value * factor)
        return st.one_of(st.just(value), scaled, scaled, anything)

    pairs = st.sampled_from(sorted(usual)).flatmap(lambda path: st.tuples(st.just(path), value_of(path)))
    bases = st.sampled_from(sorted(path.stem for path in BUILTIN_FOLDER.glob("*.yaml")))
    return st.builds(text_of, bases, st.lists(pairs, max_size=4))


def leaves_of(block: dict[str, Any], above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield path and value of every key of a config."""
    for name, value in block.items():
        if isinstance(value, dict):
            yield from leaves_of(value, (*above, name))
        else:
            yield (*above, name), value


def text_of(base: str, pairs: list[tuple[tuple[str, ...], Any]]) -> bytes:
    """Write a config as JSON, which is valid YAML."""
    written: dict[str, Any] = {"extends": base}
    for (*blocks, name), value in pairs:
        inner = written
        for block in blocks:
            inner = inner.setdefault(block, {})
        inner[name] = value
    return json.dumps(written).encode()


def drawn_texts(count: int, seed: int) -> list[bytes]:
    """Return `count` configs drawn by hypothesis."""
    found: list[bytes] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(max_examples=count, database=None, deadline=None, phases=[hypothesis.Phase.generate])
    @hypothesis.given(configs())
    def note(text: bytes) -> None:
        found.append(text)

    note()
    return found


def loaded(path: Path) -> LoadedConfig | None:
    """Return the config of a file, or None if it is refused with a message."""
    try:
        return load(path)
    except WalkerlabError as error:
        if not error.message or error.exit_code != 3:
            raise
        return None


def fuzz_configs(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Load `count` fuzzed configs and simulate some. Return how each ended, and what went wrong."""
    drawn = random.Random(seed)
    builtin = [path.read_bytes() for path in sorted(BUILTIN_FOLDER.glob("*.yaml"))]
    texts = drawn_texts(count // 2, seed)
    texts += [fuzzed(drawn, builtin) for _ in range(count - len(texts))]
    fates: Counter[str] = Counter()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        path, runs = Path(place) / "fuzzed.yaml", Path(place) / "runs"
        for number, text in enumerate(texts):
            path.write_bytes(text)
            faulthandler.dump_traceback_later(HANGS_S, exit=True)
            try:
                fate, took_s = timed(path, runs, number)
                if took_s > LONGEST_S:  # The first try may have compiled a method, so time a second one.
                    fate, took_s = timed(path, runs, number)
                fates[fate] += 1
                if took_s > LONGEST_S:
                    wrong.append(f"config {number}: took {took_s:.0f} s\n{text!r}")
            except Exception:  # a traceback is what is looked for
                wrong.append(f"config {number}: {traceback.format_exc(limit=-3)}\n{text!r}")
            outside = [entry.name for entry in Path(place).iterdir() if entry.name not in ("fuzzed.yaml", "runs")]
            if outside:
                wrong.append(f"config {number}: wrote {outside} outside the runs folder")
            if (number + 1) % TOLD_EVERY == 0:
                print(f"{number + 1} of {count} configs, {len(wrong)} wrong", file=sys.stderr, flush=True)
        faulthandler.cancel_dump_traceback_later()
    return fates, wrong


def timed(path: Path, runs: Path, number: int) -> tuple[str, float]:
    """Return how a config ended, and the processor time it took (s)."""
    began = time.process_time()
    return fate_of(path, runs, number), time.process_time() - began


def fate_of(path: Path, runs: Path, number: int) -> str:
    """Load a config, and simulate a few strides of every fourth one. Return how it ended."""
    found = loaded(path)
    if found is None:
        return "refused with its position"
    if number % WALKED:
        return "accepted"
    config = found.config.model_copy(update={"strides": min(found.config.strides, 5)})
    on_ground = config.contact is not None and number % WALKED_ON_GROUND == 0
    stage = "contact-sim" if on_ground else "simulate"
    report = execute(config, stage, RunFolder(runs, found.run_name), Options(force=True))
    return (
        f"accepted, {stage} walked" if report.no_answer is None else f"accepted, {stage} reports that it has no answer"
    )


def damage_results(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Damage a stored result `count` times. Return how often results were accepted, and what went wrong."""
    drawn = random.Random(seed)
    fates: Counter[str] = Counter()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        found = load(Path("rigid-only"))
        folder = RunFolder(Path(place), found.run_name)
        execute(found.config, "simulate", folder)
        path = folder.artifact("simulate")
        whole = path.read_bytes()
        good = artifact.read(path)
        for number in range(count):
            how = drawn.choice(WAYS)
            damaged = how(drawn, whole)
            path.write_bytes(damaged)
            try:
                verdict = artifact.check(path, good.identity.key)
            except Exception:  # a traceback is what is looked for
                wrong.append(f"damage {number} ({how.__name__}): {traceback.format_exc(limit=-3)}")
                continue
            if not verdict.accepted:
                fates["not accepted"] += 1
            elif verdict.artifact is not None and verdict.artifact.digest() == good.digest():
                fates["accepted: the content is whole"] += 1
            else:
                wrong.append(f"damage {number} ({how.__name__}): accepted with another content")
        path.write_bytes(whole[: len(whole) // 2])
        execute(found.config, "simulate", folder)
        if artifact.read(path).digest() != good.digest():
            wrong.append("a damaged result was not recomputed")
    return fates, wrong


def main() -> int:
    """Run both campaigns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--configs", type=int, default=2000)
    parser.add_argument("--damaged", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    began = time.perf_counter()
    # Damaged results come first: they compile the model, which would otherwise look like a hang.
    damaged, wrong_too = damage_results(asked.damaged, asked.seed)
    configs, wrong = fuzz_configs(asked.configs, asked.seed)
    print("| what | fate | times |\n|---|---|---|")
    for what, fates in (("config", configs), ("damaged result", damaged)):
        for fate, times in sorted(fates.items()):
            print(f"| {what} | {fate} | {times} |")
    print(f"| both | wrong | {len(wrong + wrong_too)} |\n\n{time.perf_counter() - began:.0f} s")
    print("\n".join(wrong + wrong_too), file=sys.stderr)
    return 1 if wrong or wrong_too else 0


if __name__ == "__main__":
    sys.exit(main())
