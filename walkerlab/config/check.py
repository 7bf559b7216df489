"""The check block: a gait as printed, with its digits and its conventions."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import AfterValidator, create_model

from walkerlab.config.fields import Block, Text, check_value, key, meaning_error

Body = Literal["swing", "stance", "shank"]
Instant = Literal["after-strike", "before-strike", "mid-stance"]
MAX_PRINTED = 64  # maximum number of characters in a printed value
_NUMBER: Final = r"(?:\d+\.?\d*|\.\d+)(?:e[-+]?0{0,2}\d{1,2})?"  # some systems print e-005
_SIGNED: Final = rf"[-+]?{_NUMBER}"
_WORDS: Final = {
    "zero": "0", "half": "0.5", "one": "1", "two": "2", "three": "3", "four": "4", "five": "5", "six": "6",
    "seven": "7", "eight": "8", "nine": "9", "ten": "10",
}  # fmt: skip
FORMS: Final = "a number such as 0.1895, 0.62+0.1i, < 1, 0.51 ± 0.02 or 0.4 to 0.6"


@dataclass(frozen=True)
class Digits:
    """A number as printed: its value, the unit of its last digit, and its significant digits."""

    value: float
    unit: float
    count: int


@dataclass(frozen=True)
class PrintedValue:
    """A printed value: one number, two for a complex one, or bounds."""

    text: str
    real: Digits
    imaginary: Digits | None = None
    bounds: tuple[float, float] | None = None  # bounds, if a range, an uncertainty or 'less than' is printed
    both_signs: bool = False  # whether the imaginary part is printed with ±

    @property
    def value(self) -> complex:
        return complex(self.real.value, 0.0 if self.imaginary is None else self.imaginary.value)


def digits_of(text: str) -> Digits:
    """Read a printed number with its digits: '-.50' has 2 digits, and the unit of the last one is 0.01."""
    mantissa, _, exponent = text.lstrip("+-").partition("e")
    scale = int(exponent or 0) - len(mantissa.partition(".")[2])
    figures = mantissa.replace(".", "").lstrip("0")
    return Digits(float(text), 10.0**scale, max(len(figures), 1))


def agreement(printed: Digits, right: float, error: float = 0.0) -> str:
    """Return how the printed digits follow from the right value, 'rounded' or 'cut off', or '' if they do not follow
    from it.

    error  numerical error of the right value
    """
    if abs(right - printed.value) <= 0.5 * printed.unit * (1.0 + 1e-9) + error:
        return "rounded"
    longer = abs(right) - abs(printed.value)
    # A small negative value that is truncated to zero is printed without its sign.
    same_sign = right * printed.value > 0.0 or abs(right) < printed.unit
    return "cut off" if same_sign and -error <= longer < printed.unit + error else ""


def parse_printed(text: str) -> PrintedValue | None:
    """Read a printed value, or return None if it has none of the allowed forms."""
    plain = text.strip().lower().replace("−", "-").replace("–", "-").replace("\xa0", " ")
    # Publications write powers of ten in many ways, and copied text has several kinds of minus signs.
    plain = re.sub(r"\s*[×x·*]\s*10\s*\^?\s*\{?([-+]?\d+)\}?", r"e\1", plain).replace("+/-", "±").replace("+-", "±")
    plain = re.sub(r"\b10\s*\^\s*\{?([-+]?\d+)\}?", r"1e\1", plain)
    plain = re.sub(rf"\b({'|'.join(_WORDS)})\b", lambda match: _WORDS[match[1]], plain)
    if re.fullmatch(_SIGNED, plain):
        return PrintedValue(text, digits_of(plain))
    compact = plain.replace(" ", "")
    if match := re.fullmatch(rf"({_SIGNED})([-+±])({_NUMBER})[ij]", compact):
        sign = "-" if match[2] == "-" else ""
        return PrintedValue(text, digits_of(match[1]), digits_of(sign + match[3]), both_signs=match[2] == "±")
    if match := re.fullmatch(rf"([-+±]?)({_NUMBER})[ij]", compact):
        sign = "-" if match[1] == "-" else ""
        return PrintedValue(text, Digits(0.0, digits_of(match[2]).unit, 1), digits_of(sign + match[2]))
    if match := re.fullmatch(rf"({_SIGNED})±({_NUMBER})", compact):
        value = digits_of(match[1])
        error = float(match[2])
        return PrintedValue(text, value, bounds=(value.value - error, value.value + error))
    between = rf"(?:between|from)?({_SIGNED})(?:to|and|\.\.)({_SIGNED})"
    if match := re.fullmatch(between, compact) or re.fullmatch(rf"\[({_SIGNED}),({_SIGNED})\]", compact):
        low, high = sorted((float(match[1]), float(match[2])))
        return PrintedValue(text, digits_of(match[1]), bounds=(low, high))
    if match := re.fullmatch(rf"(<=?|≤|lessthan|below|atmost|upto)({_SIGNED})", compact):
        return PrintedValue(text, digits_of(match[2]), bounds=(float("-inf"), float(match[2])))
    if match := re.fullmatch(rf"(>=?|≥|morethan|above|atleast)({_SIGNED})", compact):
        return PrintedValue(text, digits_of(match[2]), bounds=(float(match[2]), float("inf")))
    return None


def check_readable(text: str) -> str:
    """Validate that the text of a printed value can be read."""
    if len(text) > MAX_PRINTED or parse_printed(text) is None:
        comma = " (decimals follow a point)" if re.search(r"\d,\d", text) else ""
        raise meaning_error(f"is not a printed value{comma}: give {FORMS}, without its unit")
    return text


Printed = Annotated[Text, AfterValidator(check_readable)]


class CheckSource(Block):
    """Publication in which a gait is printed."""

    title: Text | None = key(None, "", "title of the paper, thesis or program", bounds="any text")
    authors: Text | None = key(None, "", "its authors", bounds="any text")
    year: int | Text | None = key(None, "", "year of publication", bounds="a year")
    where: Text | None = key(None, "", "table, equation or line", bounds="any text")


_FROM: Any = key("vertical", "", "line from which the first angle is measured")
if TYPE_CHECKING:

    class _From(Block):
        """Declaration of the key `from`."""

else:
    # `from` is a keyword of Python, so a class body cannot declare a key of this name.
    _From = create_model("_From", __base__=Block, **{"from": (Literal["vertical", "slope-normal"], _FROM)})


class PrintedAngles(_From):
    """How the printed angles and rates are to be understood."""

    second: Literal["absolute", "relative", "stance-minus-swing"] = key(
        "absolute",
        "",
        "angle of the second leg: absolute, like the first one; relative, swing leg minus stance leg (for a shank, "
        "shank minus thigh); or stance-minus-swing, with the opposite sign",
    )
    unit: Literal["rad", "deg"] = key("rad", "", "unit of the angles; rates are in this unit per second")
    positive: Literal["counter-clockwise", "clockwise"] = key(
        "counter-clockwise", "", "direction of positive angles, for a walker that walks to the right"
    )
    order: tuple[Body, ...] | None = key(
        None,
        "",
        "bodies in the order of their angles",
        bounds="a list of swing, stance, shank, each at most once",
        default_in_words="[stance] for 2 values, [swing, stance] for 4, [swing, stance, shank] for 6",
        sequence=True,
    )
    layout: Literal["angles-first", "interleaved"] = key(
        "angles-first", "", "all angles, then all rates; or interleaved: angle, rate, angle, rate"
    )

    _each_once = check_value(
        "order",
        why=lambda order: "" if order is None or 0 < len({*order}) == len(order) else "must name each body once",
    )

    @property
    def origin(self) -> str:
        """Line from which the first angle is measured."""
        return str(getattr(self, "from"))  # the key is declared above, where the type checker cannot see it


class Check(Block):
    """A printed gait for `walkerlab check`. Give its numbers with all their digits, because trailing zeros count."""

    source: CheckSource = CheckSource()
    angles: PrintedAngles = PrintedAngles()
    instant: Instant = key("after-strike", "", "instant of the printed state")
    state_before: tuple[Printed, ...] | None = key(
        None, "", "state just before the heel strike that `state` follows", bounds="a list of numbers", sequence=True
    )
    printed: dict[Text, Printed | list[Printed] | None] = key(
        dict,
        "",
        "printed values by name: state, multipliers, or a value of fixedpoint or simulate, such as period_s",
        bounds=f"{FORMS}, or a list of them, for each name",
    )
