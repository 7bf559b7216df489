"""What is to be said of a printed number: reproduced, explained or refuted, and by which evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import ROUND_DOWN, ROUND_HALF_UP, Decimal
from enum import StrEnum

from walkerlab.paper.printed import Printed, number


class NumberVerdict(StrEnum):
    """How a printed number fares."""

    REPRODUCED = "reproduced"  # it comes out to the printed digits
    EXPLAINED = "explained"  # it does not, or not by itself, and what was measured says why
    REFUTED = "refuted"  # it contradicts what was measured, or the paper's own numbers


@dataclass(frozen=True)
class JudgedNumber:
    """A printed number beside the measured ones, in the unit it is printed in; None where a model has none."""

    printed: Printed
    as_printed: float | None
    corrected: float | None
    contact: float | None
    verdict: NumberVerdict
    evidence: str

    @property
    def summary(self) -> dict[str, str | float | None]:
        """As commands print it."""
        printed = {name: getattr(self.printed, name) for name in ("where", "quantity", "unit")}
        models = {name: getattr(self, name) for name in ("as_printed", "corrected", "contact")}
        return {
            **printed,
            "printed": self.printed.text,
            **models,
            "verdict": self.verdict.value,
            "evidence": self.evidence,
        }


def judged(
    entry: Printed, rigid: Mapping[str, float], contact: float | None, found: tuple[NumberVerdict, str]
) -> JudgedNumber:
    """A printed number beside those of the rigid model, by set of equations, and of the contact model."""
    return JudgedNumber(entry, rigid.get("as-printed"), rigid.get("corrected"), contact, *found)


def agreement(printed: Printed, value: float | None) -> str:
    """How `value` agrees with a printed number to its digits: 'rounded', 'cut off', or '' if it does not."""
    if value is None:
        return ""
    expected = number(printed.text)
    last = Decimal(1).scaleb(int(expected.as_tuple().exponent))
    found = Decimal(repr(float(value)))
    if found.quantize(last, ROUND_HALF_UP) == expected:
        return "rounded"
    return "cut off" if found.quantize(last, ROUND_DOWN) == expected else ""


def weigh(
    agrees: bool, otherwise: NumberVerdict, departures: tuple[str, ...], evidence: str
) -> tuple[NumberVerdict, str]:
    """The verdict and its evidence.

    agrees      the number came out
    otherwise   what is said if it did not, of the paper's own scene
    departures  in what the scene is not the paper's: a mismatch refutes nothing then
    """
    if agrees:
        return NumberVerdict.REPRODUCED, evidence
    if departures:
        return NumberVerdict.EXPLAINED, f"Not the paper's scene ({'; '.join(departures)}). {evidence}"
    return otherwise, evidence


def regardless(departures: tuple[str, ...], evidence: str) -> str:
    """The evidence of a verdict that follows from the paper's own numbers, which another scene does not change."""
    if not departures:
        return evidence
    return f"{evidence} The verdict is about the paper's own numbers, not about this scene ({'; '.join(departures)})."
