"""Import modules when a test first uses them, because every worker collects all tests but runs only a part of them."""

import importlib.util
import sys


def import_late(name):
    """Return a stand-in for the module that loads it when an attribute is first used."""
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.find_spec(name)
    spec.loader = importlib.util.LazyLoader(spec.loader)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
