"""Templates for the conclusions on run times and errors. Each stage has a file."""

from pathlib import Path

from walkerlab.views.prose import Prose, f


def plainly(number: float) -> str:
    """Format a number to three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):g}"


words = Prose(Path(__file__).parent, (f, plainly), {})
