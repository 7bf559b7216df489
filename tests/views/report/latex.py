"""Compile tables with LaTeX, if it is installed."""

import shutil
import subprocess

import pytest


def compile_tables(texts, options, folder):
    """Typeset tables in an article. Return LaTeX's messages about errors and about boxes that are too wide for the text
    block.
    """
    latex = shutil.which("pdflatex")
    if latex is None:
        pytest.skip("LaTeX is not installed: apt install texlive-latex-recommended texlive-science")
    packages = r"\usepackage{booktabs, graphicx, siunitx}"
    floats = "\n\\clearpage\n".join(texts)
    document = rf"\documentclass[{options}]{{article}}{packages}\begin{{document}}{floats}\end{{document}}"
    (folder / "tables.tex").write_text(document)
    command = [latex, "-interaction=nonstopmode", "tables.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    lines = done.stdout.decode("latin-1").splitlines()
    assert any(line.startswith("Output written on tables.pdf") for line in lines), lines[-20:]
    return [line for line in lines if line.startswith(("!", "Overfull")) or "Float too large" in line]
