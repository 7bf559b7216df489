"""What measured run times and errors say, as templates: a file for each stage."""

from pathlib import Path

from walkerlab.prose import Prose, f


def plainly(number: float) -> str:
    """Three digits without a power of ten."""
    return f"{float(f'{number:.3g}'):g}"


words = Prose(Path(__file__).parent, (f, plainly), {})
