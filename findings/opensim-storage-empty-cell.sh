#!/usr/bin/env bash
# OpenSim 4.6: one empty cell shifts everything that `Storage` reads, the time included, without a word.
#
# What one would guess: an empty cell between two tabs is a missing value, and labels between tabs may hold blanks, since
# the file is separated by tabs and `TimeSeriesTable`, the newer reader, takes both so (nan; 'left leg').
# What happens: `Storage`, which the tools and much Python code still use, splits at any white space. After an empty cell
# each value moves one place to the left and the next row's time is read as a value: here a time of 12.5 s and an angle
# of 22.5 that belongs to the other leg. Of the labels 'right leg' and 'left leg' it makes four for two columns.
# Version: opensim 4.6 (PyPI), November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opensim==4.6 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PYTHON'
import math
import sys

import opensim

opensim.Logger.setLevelString("off")
print("opensim", opensim.GetVersion())
HEADER = "walk\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\n"
with open("gap.mot", "w") as file:
    file.write(HEADER + "time\ta\tb\n0.00\t10.5\t20.5\n0.01\t\t21.5\n0.02\t12.5\t22.5\n")
with open("labels.mot", "w") as file:
    file.write(HEADER + "time\tright leg\tleft leg\n0.00\t10.5\t20.5\n0.01\t11.5\t21.5\n0.02\t12.5\t22.5\n")


def values(array):
    return [array.get(place) for place in range(array.getSize())]


table = opensim.TimeSeriesTable("gap.mot")
times = list(table.getIndependentColumn())
column = [float(table.getRowAtIndex(row).to_numpy()[0]) for row in range(3)]
print("TimeSeriesTable: times", times, "a", column)
old = opensim.Storage("gap.mot")
old_times, old_column = opensim.ArrayDouble(), opensim.ArrayDouble()
old.getTimeColumn(old_times)
old.getDataColumn("a", old_column)
print("Storage:         times", values(old_times), "a", values(old_column))
labelled = opensim.TimeSeriesTable("labels.mot"), opensim.Storage("labels.mot")  # kept, as their labels are views
labels = list(labelled[0].getColumnLabels())
old_labels = values(labelled[1].getColumnLabels())
print("TimeSeriesTable: labels", labels)
print("Storage:         labels", old_labels)
print("expected: times 0, 0.01, 0.02 and a 10.5, nan, 12.5; two labels and the time")
as_found = times == [0.0, 0.01, 0.02] and math.isnan(column[1])
as_found &= values(old_times) == [0.0, 0.01, 12.5] and values(old_column) == [10.5, 21.5, 22.5]
as_found &= labels == ["right leg", "left leg"] and old_labels == ["time", "right", "leg", "left", "leg"]
sys.exit(0 if as_found else "the behaviour has changed")
PYTHON
