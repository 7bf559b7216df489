"""Fuzzed configs and damaged results: never a traceback, never a hang, never NaN stored as a result.

    python scripts/fuzz_campaign.py                          # 2,000 configs, 200 damaged results
    python scripts/fuzz_campaign.py --configs 50 --damaged 20

Half of the configs are built-in ones mutated byte by byte, line by line and value by value, half are drawn key by key
by hypothesis; each is loaded, and each fourth is also walked, by the rigid model or on its ground. Damaged results are
cut short, have bits flipped, are overwritten in part, are other files, or are altered and sealed again: other shapes,
numbers, versions, hostile attributes, ten gigabytes declared. Prints a table in Markdown; exits 1 if anything is wrong.
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

LONGEST_S = 20.0  # that a config may take to be refused or walked, once its models are compiled
HANGS_S = 300.0  # after which the campaign ends with a traceback of where it hangs
WALKED, WALKED_ON_GROUND = 4, 8  # each how-manieth is walked, and with the contact model
TOLD_EVERY = 100
WORDS = (
    b"nan", b".nan", b".inf", b"-1", b"0", b"1e308", b"-1e-308", b"1e-14", b"null", b"[]", b"{}", b"true", b"'", b'"',
    b"&a", b"*a", b"!!python/object:os.system", b"../../x", b"<script>", b"\xff\xfe", b"\x00", b"? ", b"- ", b": ",
    b"99999999999999999999", b"0x10", b"1_000", b"extends: paper", b"strides: 1", b"\t", b"\r", b"---", b"%YAML 1.1",
)  # fmt: skip
Mutation = Callable[[random.Random, bytearray], None]


def change_byte(drawn: random.Random, text: bytearray) -> None:
    """Another byte somewhere."""
    text[drawn.randrange(len(text))] = drawn.randrange(256)


def delete_piece(drawn: random.Random, text: bytearray) -> None:
    """Something is missing."""
    start = drawn.randrange(len(text))
    del text[start : start + drawn.randrange(1, 40)]


def repeat_line(drawn: random.Random, text: bytearray) -> None:
    """A line twice, or elsewhere."""
    lines = text.splitlines(keepends=True)
    lines.insert(drawn.randrange(len(lines)), drawn.choice(lines))
    text[:] = b"".join(lines)


def insert_word(drawn: random.Random, text: bytearray) -> None:
    """A troublesome word somewhere."""
    at = drawn.randrange(len(text))
    text[at:at] = drawn.choice(WORDS)


def replace_value(drawn: random.Random, text: bytearray) -> None:
    """Another value of a key."""
    lines = text.splitlines()
    at = drawn.randrange(len(lines))
    name, colon, _ = bytes(lines[at]).partition(b":")
    lines[at] = bytearray(name + colon + b" " + drawn.choice(WORDS))
    text[:] = b"\n".join(lines) + b"\n"


def scale_number(drawn: random.Random, text: bytearray) -> None:
    """A number of quite another size: valid more often than not."""
    lines = text.splitlines()
    numbered = [i for i, line in enumerate(lines) if b": " in line and line.partition(b": ")[2][:1].isdigit()]
    if numbered:
        at = drawn.choice(numbered)
        name = bytes(lines[at]).partition(b":")[0]
        lines[at] = bytearray(name + b": %.3g" % (10.0 ** drawn.uniform(-6.0, 6.0)))
        text[:] = b"\n".join(lines) + b"\n"


MUTATIONS: tuple[Mutation, ...] = (change_byte, delete_piece, repeat_line, insert_word, replace_value, scale_number)


def fuzzed(drawn: random.Random, texts: list[bytes]) -> bytes:
    """A built-in config, mutated once to four times."""
    text = bytearray(drawn.choice(texts))
    for _ in range(drawn.randrange(1, 5)):
        if text:
            drawn.choice(MUTATIONS)(drawn, text)
    return bytes(text)


def configs() -> st.SearchStrategy[bytes]:
    """A few keys over a built-in config: of any value, or of one near to what they are."""
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
    """Path and value of everything in a config."""
    for name, value in block.items():
        if isinstance(value, dict):
            yield from leaves_of(value, (*above, name))
        else:
            yield (*above, name), value


def text_of(base: str, pairs: list[tuple[tuple[str, ...], Any]]) -> bytes:
    """A config as YAML that is JSON as well."""
    written: dict[str, Any] = {"extends": base}
    for (*blocks, name), value in pairs:
        inner = written
        for block in blocks:
            inner = inner.setdefault(block, {})
        inner[name] = value
    return json.dumps(written).encode()


def drawn_texts(count: int, seed: int) -> list[bytes]:
    """So many configs that hypothesis draws."""
    found: list[bytes] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(max_examples=count, database=None, deadline=None, phases=[hypothesis.Phase.generate])
    @hypothesis.given(configs())
    def note(text: bytes) -> None:
        found.append(text)

    note()
    return found


def loaded(path: Path) -> LoadedConfig | None:
    """The config of a file, or None if it is refused in words."""
    try:
        return load(path)
    except WalkerlabError as error:
        if not error.message or error.exit_code != 3:
            raise
        return None


def fuzz_configs(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Load `count` fuzzed configs, walk some; what became of them, and what went wrong."""
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
                if took_s > LONGEST_S:  # it may have had a method compiled: once more
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
    """What becomes of a config, and the processor time (s) that it takes."""
    began = time.process_time()
    return fate_of(path, runs, number), time.process_time() - began


def fate_of(path: Path, runs: Path, number: int) -> str:
    """Load a config, and walk some, a few strides at most."""
    found = loaded(path)
    if found is None:
        return "refused with its place"
    if number % WALKED:
        return "accepted"
    config = found.config.model_copy(update={"strides": min(found.config.strides, 5)})
    on_ground = config.contact is not None and number % WALKED_ON_GROUND == 0
    stage = "contact-sim" if on_ground else "simulate"
    report = execute(config, stage, RunFolder(runs, found.run_name), Options(force=True))
    return f"accepted, {stage} walked" if report.no_answer is None else f"accepted, {stage} has no answer, told"


def damage_results(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Damage a stored result `count` times; what was said of it, and what went wrong."""
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
            wrong.append("a damaged result is not made anew")
    return fates, wrong


def main() -> int:
    """Run both campaigns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--configs", type=int, default=2000)
    parser.add_argument("--damaged", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    began = time.perf_counter()
    # first, since it has the model compiled, which would count as a hang
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
