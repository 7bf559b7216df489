"""Tests of the registry of methods: its names, its entries, and the cost of importing it."""

import importlib.util
import subprocess
import sys

import pytest

from walkerlab.config.schema import CVODE_PACKAGE
from walkerlab.config.schema import METHODS as NAMES
from walkerlab.physics.solvers import cvode
from walkerlab.physics.solvers import registry as registry_module
from walkerlab.physics.solvers.registry import CVODE_METHODS, METHODS, method_named

OF_CVODE = {method.name for method in CVODE_METHODS}


def test_config_accepts_exactly_the_registered_methods():
    assert set(NAMES) == {*METHODS, *OF_CVODE}


def test_cvode_is_available_if_its_package_is():
    assert cvode.SUNDIALS_PACKAGE == CVODE_PACKAGE
    there = importlib.util.find_spec(cvode.SUNDIALS_PACKAGE) is not None
    assert set(METHODS) >= OF_CVODE if there else not set(METHODS) & OF_CVODE


def test_unknown_method_is_an_error_that_lists_the_known_ones():
    with pytest.raises(KeyError, match="dop853, radau5"):
        method_named("euler")


def test_method_that_is_not_installed_names_the_package_to_install(monkeypatch):
    monkeypatch.setattr(registry_module, "METHODS", {})
    with pytest.raises(KeyError, match="pip install scikit-sundae"):
        method_named("cvode-bdf")


def test_libraries_are_imported_only_when_used():
    loaded = "print('scipy.integrate' in sys.modules, 'sksundae' in sys.modules)"
    look = f"import sys, walkerlab.physics.solvers.registry; {loaded}"
    found = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["False", "False"]
