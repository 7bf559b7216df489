#!/usr/bin/env bash
# OpenSim 4.6: the ending of a table decides the unit of its angles.
#
# What one would guess: a header that says `inDegrees=no` holds radians, and the same text means the same as .mot and
# as .sto. Without `inDegrees`, angles are in radians, as in every other OpenSim table.
# What happens: `Storage` takes a .mot file without a line `version=...` (SIMM's form) to be in degrees, with or without
# `inDegrees=no`. The same text as .sto is in radians. `TimeSeriesTable` keeps what the header says and decides nothing,
# so two readers of one library disagree about `inDegrees=no`.
# Version: opensim 4.6 (PyPI), November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opensim==4.6 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PYTHON'
import sys

import opensim

opensim.Logger.setLevelString("off")
print("opensim", opensim.GetVersion())
SIMM = "name walk\ndatacolumns 2\ndatarows 2\n"
HEADERS = {
    "SIMM's form": SIMM,
    "SIMM's form, inDegrees=no": SIMM + "inDegrees=no\n",
    "version=1": "walk\nversion=1\nnRows=2\nnColumns=2\n",
    "version=1, inDegrees=no": "walk\nversion=1\nnRows=2\nnColumns=2\ninDegrees=no\n",
}
in_degrees, stated = {}, {}
for name, header in HEADERS.items():
    for ending in ("mot", "sto"):
        path = f"walk.{ending}"
        with open(path, "w") as file:
            file.write(header + "endheader\ntime\thip\n0\t0.1\n1\t0.2\n")
        in_degrees[name, ending] = opensim.Storage(path).isInDegrees()
        table = opensim.TimeSeriesTable(path)
        keys = list(table.getTableMetaDataKeys())
        stated[name, ending] = table.getTableMetaDataString("inDegrees") if "inDegrees" in keys else None
        print(f"{name:27} .{ending}: Storage.isInDegrees() {in_degrees[name, ending]!s:5} "
              f"TimeSeriesTable's inDegrees {stated[name, ending]}")
print("expected: no file in degrees")
surprising = {key for key, degrees in in_degrees.items() if degrees}
print("actual:   in degrees are", sorted(surprising))
as_found = surprising == {("SIMM's form", "mot"), ("SIMM's form, inDegrees=no", "mot")}
as_found &= stated["SIMM's form, inDegrees=no", "mot"] == "no" and stated["SIMM's form", "mot"] is None
sys.exit(0 if as_found else "the behaviour has changed")
PYTHON
