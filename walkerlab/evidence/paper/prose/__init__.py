"""Templates for texts about the paper, which can use its printed values and quantities derived from them.

This is a package of its own, so that its words affect only the results of modules that import it.
"""

import math
from pathlib import Path

from walkerlab.config.contact import MM_PER_M
from walkerlab.evidence.paper import printed
from walkerlab.views.prose import Prose, f

PRINTED_VALUES = vars(printed) | {"pi": math.pi, "MM_PER_M": MM_PER_M}
prose = Prose(
    Path(__file__).parent, (f,), {name: value for name, value in PRINTED_VALUES.items() if not name.startswith("_")}
)
