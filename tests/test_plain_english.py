"""Check plain English as far as a machine can: names, beginnings of docstrings, and references.

The rules are in CONTRIBUTING.md.
"""

import ast
import re
from functools import cache
from pathlib import Path

import walkerlab

PROJECT = Path(__file__).parents[1]
"""The checkout. The package may be installed elsewhere, without the docs beside it."""
PACKAGE = Path(walkerlab.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))
PARTICIPLES = {
    "asked", "begun", "counted", "drawn", "found", "held", "kept", "made", "meant", "met", "said", "shown", "sought",
    "spoken", "taken", "told", "walked", "wanted",
}  # fmt: skip
"""Participles: they say what was done to something instead of what it is."""
FRAGMENT = re.compile(
    r"(Of|What|That of|Those|Whom|To whom|By what|It (does|is)\b|Its|None|In which|With what|Nothing|So many|Some|As|At"
    r"|From|Where|Between|Until|Once|If|Such)\b"
)
REFERENCE = re.compile(r"`([a-z_]+(?:\.[A-Za-z_]+)+)`|\b((?:[a-z_]+/)*[a-z_]+\.(?:pyi?|md))\b")
LIBRARIES = {"scipy", "numpy", "matplotlib", "mujoco", "numba"}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def named(path):
    return str(path.relative_to(PACKAGE))


def assigned_names(tree):
    """Yield the names of functions, classes, arguments and variables, with their lines."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name.strip("_"), node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id.strip("_"), node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg.strip("_"), node.lineno


def test_function_names_are_not_participles_or_genitives():
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    nodes = [(path, node) for path in SOURCES for node in ast.walk(tree_of(path)) if isinstance(node, functions)]
    names = [(named(path), node.lineno, node.name.strip("_")) for path, node in nodes]
    assert len(names) > 1000
    assert [(*place, name) for *place, name in names if name.split("_")[0] in PARTICIPLES] == []
    assert [(*place, name) for *place, name in names if name.startswith("of_")] == []


def test_docstrings_do_not_begin_as_fragments():
    nodes = [(path, node) for path in SOURCES for node in ast.walk(tree_of(path)) if isinstance(node, DOCUMENTED)]
    texts = [(named(path), getattr(node, "lineno", 1), ast.get_docstring(node) or "") for path, node in nodes]
    assert [(*place, text.split("\n")[0]) for *place, text in texts if FRAGMENT.match(text)] == []


def test_references_in_docstrings_exist():
    """Files named in docstrings and comments must exist, and dotted names in backticks must be names of the package."""
    files = {path.name for path in PROJECT.rglob("*.*") if ".git" not in path.parts}
    trees = {path: tree_of(path) for path in SOURCES}
    words = {name for tree in trees.values() for name, _ in assigned_names(tree)} | {path.stem for path in SOURCES}
    words |= {path.name for path in PACKAGE.rglob("*") if path.is_dir()} | {"walkerlab"}
    words |= {node.attr for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    lost = []
    for path, tree in trees.items():
        for node in ast.walk(tree):
            text = ast.get_docstring(node) if isinstance(node, DOCUMENTED) else None
            for dotted, file in REFERENCE.findall(text or ""):
                if dotted.endswith((".py", ".pyi", ".md")):
                    dotted, file = "", dotted
                known = dotted.split(".")[0] in LIBRARIES or set(dotted.split(".")) <= words | {""}
                if (file and Path(file).name not in files) or not known:
                    lost.append((named(path), dotted or file))
    assert lost == []
