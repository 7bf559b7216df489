"""Fixture of one server for all tests of a file."""

import pytest
from explored import Served


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    one = Served(tmp_path_factory.mktemp("explored"))
    yield one
    one.close()
