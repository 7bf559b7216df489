#!/usr/bin/env bash
# Numba's file cache can run code that was compiled for another record type, and returns wrong numbers.
#
# A user would guess: `cache=True` gives the values of the uncompiled function, whichever processes filled the cache.
# What happens: numba names a record type in machine-code symbols by a number that it counts up in each process. Two
# processes that compile a function for records of different layout give the inner functions the same symbol. A third
# process that loads both from the cache runs one layout's code on the other: it reads the wrong field, or memory
# outside the record.
# Versions: numba 0.68.1, llvmlite 0.50.0, numpy 2.4.6. Source: numba/core/types/npytypes.py, Record.mangling_args and
# `_code`; found by two commands that filled one cache side by side.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q numba==0.68.1 llvmlite==0.50.0 numpy==2.4.6

cat >reader.py <<'PY'
import sys

import numba
import numpy as np


@numba.njit
def last(record, n):
    """Return record.y; the loops only keep the compiler from copying the function into its caller."""
    total = 0.0
    for i in range(n):
        for j in range(i):
            if (i * j) % 7 == 3:
                total += np.sin(record.y * i) * np.cos(record.y * j)
            elif (i + j) % 5 == 2:
                total -= np.exp(-record.y * j)
            else:
                total += record.y - np.sqrt(record.y * record.y)
    return record.y if total < 1e300 else total


@numba.njit(cache=True)
def last_of(records, n):
    return last(records[0], n) + last(records[0], n + 1) - last(records[0], n + 2)


def records_of(length):
    """Return an array of one record with `length` numbers x, all 77, and the number y = length."""
    records = np.zeros(1, [("x", "f8", (length,)), ("y", "f8")])
    records["x"] = 77.0
    records["y"] = length
    return records


print(*(last_of(records_of(int(length)), 5) for length in sys.argv[1:]))
PY

venv/bin/python -c "import numba; print('numba', numba.__version__)"
echo "process 1, records with 2 numbers x: y = $(venv/bin/python reader.py 2)"
echo "process 2, records with 3 numbers x: y = $(venv/bin/python reader.py 3)"
actual=$(venv/bin/python reader.py 2 3)
echo "process 3, both, from the cache: expected 2.0 3.0, actual $actual"
rm -rf __pycache__
fresh=$(venv/bin/python reader.py 2 3)
echo "process 4, both, compiled in one process: $fresh"
[ "$fresh" = "2.0 3.0" ] || { echo "changed: the values are wrong without the cache, too"; exit 1; }
[ "$actual" != "2.0 3.0" ] || { echo "changed: the values from the cache are right now"; exit 1; }
