#!/usr/bin/env bash
# typer 0.12.5 with a later click runs a program's --version for every command, and exits 0.
#
# What one would guess: typer 0.12.5 asks for click 8.0.0 or later, so the newest click works, or fails loudly.
# What happens: with click 8.5.1 the usual eager option `version: bool = Option(False, "--version", callback=...)` gets a
# true value although it is not given: `program walk` prints the version instead of walking, with exit code 0. Scripts
# see success and no result. Only a cap on click, or typer 0.26 and later (which bring their own click), help.
# Versions: typer 0.12.5 and 0.26.0, click 8.5.1, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat >program.py <<'PYTHON'
import typer

app = typer.Typer(rich_markup_mode=None)


def show(requested: bool) -> None:
    if requested:
        typer.echo("program 1.0")
        raise typer.Exit


@app.callback()
def options(version: bool = typer.Option(False, "--version", is_eager=True, callback=show)) -> None:
    pass


@app.command()
def walk() -> None:
    typer.echo("walked")


app()
PYTHON
answer_with() { # requirements...
    rm -rf venv
    python3 -m venv venv
    venv/bin/pip install --quiet --disable-pip-version-check "$@"
    venv/bin/python program.py walk 2>&1 || echo "exit code $?"
}
old=$(answer_with typer==0.12.5 click==8.5.1)
new=$(answer_with typer==0.26.0)
echo "typer 0.12.5 with click 8.5.1: expected 'walked', got '$old'"
echo "typer 0.26.0: expected 'walked', got '$new'"
[ "$old" = "program 1.0" ] && [ "$new" = "walked" ]
