"""Tests of the solvers on extreme cases and on problems with known answers."""
