"""Plant mistakes into gaits of random walkers and count how often `walkerlab check` names them.

    python scripts/check_campaign.py [WALKERS [RIGHT [UNLISTED]]]

WALKERS random walkers for each mistake (5), printed to 4, 6 and 10 digits; RIGHT right gaits printed to 3 to 12 digits
(100); UNLISTED gaits with mistakes that no list has (100). Exits 1 if an answer is wrong.
"""

import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "evidence" / "check"))

from mistaken_walks import MISTAKES, UNLISTED, answer_to, gait, gait_with, walkers


def named(words: str, digits: int, answer: dict) -> bool:
    """Whether an answer names a planted mistake, alone unless few digits are printed."""
    told = [each["what"] for each in answer["explanations"]]
    return any(words in what for what in told) and (digits == 4 or len(told) == 1)


def planted(count: int) -> int:
    wrong = 0
    for place, (words, mistake) in enumerate(MISTAKES.items()):
        done = 0
        for legs, start in walkers(place) if count else ():
            factor = {"hip": mistake["hip"] * legs.hip} if "hip" in mistake else {}
            found = gait_with(legs, start, {**mistake, **factor})
            if found is None:
                continue
            for digits in (4, 6, 10):
                answer = answer_to(legs, *found, digits)
                if not named(words, digits, answer):
                    wrong += 1
                    print(
                        words, digits, answer["finding"], [e["what"] for e in answer["explanations"]], legs, flush=True
                    )
            done += 1
            if done == count:
                break
    return wrong


def right(count: int) -> int:
    wrong = 0
    for place, (legs, start) in enumerate(islice(walkers(100), count)):
        state, period = gait(legs, start)
        answer = answer_to(legs, state, period, 3 + place % 10)
        if answer["finding"] != "reproduced" or answer["explanations"]:
            wrong += 1
            print("right:", 3 + place % 10, answer["finding"], answer["explanations"], legs)
    return wrong


def unlisted(count: int) -> int:
    wrong = done = 0
    for place, (legs, start) in enumerate(walkers(200) if count else ()):
        name = (*UNLISTED,)[place % 2]
        found = gait(replace(legs, **{name: UNLISTED[name]}), start)
        if found is None:
            continue
        digits = (4, 6, 10)[place % 3]
        answer = answer_to(legs, *found, digits)
        if answer["finding"] != "different, unexplained" or answer["explanations"]:
            wrong += 1
            print(name, digits, answer["finding"], [e["what"] for e in answer["explanations"]], legs)
        done += 1
        if done == count:
            break
    return wrong


def main() -> int:
    counts = [int(word) for word in sys.argv[1:]] + [5, 100, 100][len(sys.argv) - 1 :]
    totals = {"planted": planted(counts[0]), "right": right(counts[1]), "unlisted": unlisted(counts[2])}
    print("wrong answers:", totals)
    return int(any(totals.values()))


if __name__ == "__main__":
    sys.exit(main())
