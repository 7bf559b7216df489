#!/usr/bin/env bash
# NUMBA_CPU_NAME alone does not make portable code: the features of the compiling processor stay switched on.
#
# A user would guess: NUMBA_CPU_NAME=x86-64 (the oldest x86-64 processors) gives code that runs on each of them, as
# `-march=x86-64` does for C compilers, and as NUMBA_CPU_NAME=generic does.
# What happens: the code uses AVX if the compiling processor has it. Numba empties the list of features only for the
# name `generic`; for any other name it keeps the host's. An empty NUMBA_CPU_FEATURES gives what the name promises.
# Versions: numba 0.68.1, llvmlite 0.50.0, numpy 2.4.6. Source: numba/core/config.py, CPU_FEATURES.
set -euo pipefail
[ "$(uname -m)" = x86_64 ] && grep -qw avx /proc/cpuinfo || { echo "needs an x86-64 Linux processor with AVX"; exit 0; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q numba==0.68.1 llvmlite==0.50.0 numpy==2.4.6

cat >count.py <<'PY'
import re

import numba


@numba.njit
def total(a, b):
    return a * b + a


total(1.5, 2.5)
(text,) = total.inspect_asm().values()
print(len(re.findall(r"^\s+v(?:mul|add)sd\b", text, flags=re.M)))
PY

unset NUMBA_CPU_NAME NUMBA_CPU_FEATURES
by_name=$(NUMBA_CPU_NAME=x86-64 venv/bin/python count.py)
generic=$(NUMBA_CPU_NAME=generic venv/bin/python count.py)
without=$(NUMBA_CPU_NAME=x86-64 NUMBA_CPU_FEATURES='' venv/bin/python count.py)
venv/bin/python -c "import numba; print('numba', numba.__version__)"
echo "AVX instructions for NUMBA_CPU_NAME=x86-64: expected 0, actual $by_name"
echo "for NUMBA_CPU_NAME=generic: $generic"
echo "for NUMBA_CPU_NAME=x86-64 and an empty NUMBA_CPU_FEATURES: $without"
[ "$generic" = 0 ] && [ "$without" = 0 ] || { echo "changed: AVX without being asked for"; exit 1; }
[ "$by_name" -gt 0 ] || { echo "changed: the name alone suffices"; exit 1; }
