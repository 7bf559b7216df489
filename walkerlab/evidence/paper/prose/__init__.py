"""Templates for texts about the paper. They can use its printed values, and functions that derive others from them.

This is a separate package, so that rewording a text affects only the results of modules that import it.
"""

import math
from pathlib import Path

from walkerlab.config.contact import MM_PER_M
from walkerlab.evidence.paper import printed
from walkerlab.views.prose import Prose, f

PRINTED_VALUES = {name: value for name, value in vars(printed).items() if not name.startswith("_")}
prose = Prose(Path(__file__).parent, (f,), PRINTED_VALUES | {"pi": math.pi, "MM_PER_M": MM_PER_M})
