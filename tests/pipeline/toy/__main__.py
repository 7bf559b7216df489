"""`python -m toy` is the command line of the toy pipeline."""

from toy.pipeline import GRAPH
from walkerlab.views.cli.main import program

program(GRAPH)(prog_name="toy")
