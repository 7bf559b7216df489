#!/usr/bin/env bash
# Octave's load of an HDF5 file stops at a text that it cannot convert, and returns what came before it, by name.
#
# What one would guess: `load` returns every array, or fails; fixed-length UTF-8 is the portable choice for text.
# What happens: only a scalar or a list of fixed-length texts that are marked as ASCII is read. Text of variable length,
# fixed-length text marked as UTF-8 (even if it is plain ASCII), and text with two dimensions print a warning; `load`
# returns without an error, and every array whose name sorts after that text is missing. UTF-8 bytes that are marked as
# ASCII load, non-ASCII letters included.
# Version: Octave 7.3.0 (Debian 12, HDF5 1.10.8) with h5py 3.16.0, November 2026.
# Needs octave-cli (Debian: apt-get install octave).
set -euo pipefail
command -v octave-cli >/dev/null || { echo "no octave-cli here: apt-get install octave"; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check h5py==3.16.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import h5py
import numpy as np

texts = [b"walked", "f\u00e4llt".encode()]
kinds = {
    "ascii-list": (texts, h5py.string_dtype("ascii", 6)),
    "utf8-list": ([b"walked", b"fell"], h5py.string_dtype("utf-8", 6)),
    "variable-list": ([b"walked", b"fell"], h5py.string_dtype()),
    "ascii-grid": ([[b"walked", b"fell"]] * 2, h5py.string_dtype("ascii", 6)),
}
for name, (values, dtype) in kinds.items():
    with h5py.File(f"{name}.h5", "w") as file:
        file["a"] = np.arange(3.0)
        file.create_dataset("m", data=np.array(values, object if dtype.kind == "O" else "S6"), dtype=None if dtype.kind != "O" else dtype)
        if name == "utf8-list":
            del file["m"]
            space = h5py.h5s.create_simple((2,))
            kind = h5py.h5t.py_create(dtype, logical=True)
            h5py.h5d.create(file.id, b"m", kind, space).write(space, space, np.array(values, dtype), kind)
        file["z"] = np.arange(3.0)
PYTHON
octave-cli --version | head -n 1
status=0
for case in "ascii-list a m z" "utf8-list a" "variable-list a" "ascii-grid a"; do
    set -- $case
    name=$1
    shift
    got=$(octave-cli --quiet --eval "x = load('$name.h5'); printf('%s ', fieldnames(x){:});" 2>/dev/null || true)
    echo "$name: expected a m z, loaded: $got"
    [ "$got" = "$* " ] || { echo "  this differs from what was seen: $*"; status=1; }
done
exit $status
