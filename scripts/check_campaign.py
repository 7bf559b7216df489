"""Plant mistakes into gaits of random walkers and count how often `walkerlab check` names them.

    python scripts/check_campaign.py PART [COUNT [FIRST]]

PART is one of
    straight, kneed     planted mistakes, COUNT walkers (5) for each, printed to 4, 6 and 10 digits
    right               COUNT right gaits (100) printed to 3 to 12 digits
    unlisted            COUNT gaits (100) with mistakes that no list has
    conventions         COUNT gaits (50) in conventions that are not stated
    combined            COUNT gaits (20) with a mistake, in conventions that are not stated
    odd                 COUNT odd files (200)

FIRST is the mistake to begin with. Exits 1 if an answer is wrong. States with mistakes come from the integration in
tests/evidence/check, not from the code that judges.
"""

import random
import sys
import tempfile
from collections import Counter
from itertools import islice
from pathlib import Path

from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "evidence" / "check"))

import mistaken_knees
import mistaken_walks
from mistaken_walks import UNLISTED, answer_to, checked_config, gait, gait_with, walkers
from printed_forms import odd_file, printed_in, random_convention

from walkerlab.evidence.check.answer import check_gait
from walkerlab.views.cli.main import program

KINDS = {
    "straight": (mistaken_walks.MISTAKES, mistaken_walks.step, mistaken_walks.random_legs, mistaken_walks.config_of),
    "kneed": (mistaken_knees.MISTAKES, mistaken_knees.step, mistaken_knees.random_knees, mistaken_knees.config_of),
}
DIGITS = (4, 6, 10)
MOST_WALKERS = 25  # maximum number of walkers to draw for a mistake, because with some mistakes few walkers have a gait


def report(*words) -> None:
    print(*words, flush=True)


def causes(answer: dict) -> list[str]:
    return [each["what"] for each in answer["explanations"]]


def mistaken_gaits(kind: str, place: int, mistake: dict):
    """Yield gaits of random walkers with a mistake. Walkers that have no gait with the mistake are skipped."""
    _, step, make, config_of = KINDS[kind]
    for legs, start in islice(walkers(place, make, config_of), MOST_WALKERS):
        found = gait_with(legs, start, mistake, step)
        if found is not None:
            yield config_of(legs), found


def planted(kind: str, count: int, first: int) -> int:
    wrong = 0
    for place, (words, mistake) in [*enumerate(KINDS[kind][0].items())][first:]:
        tally = Counter()
        gaits = [*islice(mistaken_gaits(kind, place, mistake), count)]
        for config, found in gaits:
            for digits in DIGITS:
                answer = answer_to(config, *found, digits)
                told = causes(answer)
                # If few digits are printed, several causes may explain them.
                named = any(words in what for what in told) and (digits == min(DIGITS) or len(told) == 1)
                tally[digits] += named
                if not named:
                    report("  missed:", digits, answer["finding"], told, answer["closest"], found, config)
        wrong += len(DIGITS) * len(gaits) - tally.total()
        report(place, words, {digits: f"{tally[digits]} of {len(gaits)}" for digits in DIGITS})
    return wrong


def right(count: int) -> int:
    wrong = 0
    for place, kind in enumerate((*KINDS,)):
        _, step, make, config_of = KINDS[kind]
        for number, (legs, start) in enumerate(islice(walkers(100, make, config_of), count // 2)):
            answer = answer_to(config_of(legs), *gait(legs, start, step), 3 + (number + place) % 10)
            if answer["finding"] != "reproduced" or answer["explanations"]:
                wrong += 1
                report("right:", number, answer["finding"], causes(answer), legs)
    return wrong


def unlisted(count: int) -> int:
    wrong = 0
    for kind in KINDS:
        for place, (name, size) in enumerate(UNLISTED.items()):
            found = mistaken_gaits(kind, 200 + place, {name: size})
            for number, (config, printed) in enumerate(islice(found, count // (2 * len(UNLISTED)) + 1)):
                digits = DIGITS[number % 3]
                answer = answer_to(config, *printed, digits)
                if answer["finding"] != "different, unexplained" or answer["explanations"]:
                    wrong += 1
                    report("unlisted:", kind, name, digits, answer["finding"], causes(answer), config)
    return wrong


def in_conventions(count: int, mistakes: bool) -> int:
    """Print gaits in random conventions, with or without a planted mistake, and check that the answers name both."""
    wrong = 0
    generator = random.Random(300)
    words, mistake = "", {}
    tally = Counter()
    for number in range(count):
        if mistakes:
            words, mistake = [*mistaken_walks.MISTAKES.items()][number % len(mistaken_walks.MISTAKES)]
        config, (state, period) = next(mistaken_gaits("straight", 300 + number, mistake))
        convention = random_convention(generator, changes=1 + number % (2 if mistakes else 6))
        texts = printed_in(convention, config, state, period, digits=generator.choice((6, 8)))
        answer = check_gait(checked_config(config, {"angles": {}, "printed": texts}))
        told = causes(answer)
        kinds = {each["kind"] for each in answer["explanations"]}
        found = bool(told) and (any(words in what for what in told) if mistakes else kinds == {"convention"})
        found = found and (len(told) == 1 or bool(answer["undecided"]))
        tally["found" if found else "missed", len(convention.changes)] += 1
        if not found:
            wrong += 1
            report("conventions:", convention.changes, words, answer["finding"], told, answer["closest"], config)
    report(dict(sorted(tally.items())))
    return wrong


def odd(count: int) -> int:
    wrong = 0
    generator = random.Random(400)
    tally = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            file = Path(folder) / f"odd-{number}.yaml"
            file.write_bytes(odd_file(generator))
            done = CliRunner().invoke(program(), ["check", str(file)])
            tally[done.exit_code] += 1
            if done.exit_code not in (0, 3) or "Traceback" in done.output or not done.output.strip():
                wrong += 1
                report("odd:", done.exit_code, file.read_bytes(), done.output[-600:], done.exception)
    report("exit codes:", dict(tally))
    return wrong


PARTS = {
    "straight": (lambda count, first: planted("straight", count, first), 5),
    "kneed": (lambda count, first: planted("kneed", count, first), 5),
    "right": (lambda count, _: right(count), 100),
    "unlisted": (lambda count, _: unlisted(count), 100),
    "conventions": (lambda count, _: in_conventions(count, mistakes=False), 50),
    "combined": (lambda count, _: in_conventions(count, mistakes=True), 20),
    "odd": (lambda count, _: odd(count), 200),
}


def main() -> int:
    part = PARTS.get(sys.argv[1] if len(sys.argv) > 1 else "")
    if part is None:
        sys.exit(f"usage: check_campaign.py {'|'.join(PARTS)} [COUNT [FIRST]]")
    run, usual = part
    count, first = (*map(int, sys.argv[2:]), *(usual, 0)[len(sys.argv) - 2 :])
    wrong = run(count, first)
    report("wrong answers:", wrong)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
