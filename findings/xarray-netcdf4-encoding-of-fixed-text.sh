#!/usr/bin/env bash
# xarray decodes fixed-length HDF5 text by its attribute _Encoding with one engine, and stops with the other.
#
# What one would guess: the two netCDF-4 engines of xarray open one file with the same result.
# What happens: text of fixed length with `_Encoding = "utf-8"` (the netCDF convention, which xarray itself applies) is
# decoded by the engine h5netcdf. netCDF4 returns such text decoded already, xarray decodes it once more, and stops with
# AttributeError: 'str' object has no attribute 'decode'. Without the attribute h5netcdf gives bytes, netCDF4 text: no way
# of storing text of fixed length, other than as characters, is text in both.
# Versions: xarray 2026.9.0, netCDF4 1.7.5.1.post1, h5netcdf 1.8.2, h5py 3.16.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check xarray==2026.9.0 netCDF4==1.7.5.1.post1 h5netcdf==1.8.2 h5py==3.16.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys
from importlib.metadata import version

import h5py
import numpy as np
import xarray

print({name: version(name) for name in ("xarray", "netCDF4", "h5netcdf", "h5py")})
for name, marked in (("marked.h5", True), ("bare.h5", False)):
    with h5py.File(name, "w", track_order=True) as file:
        file["step"] = np.arange(2)
        file["step"].make_scale("step")
        file["outcome"] = np.array([b"walked", "f\u00e4llt".encode()])
        file["outcome"].dims[0].attach_scale(file["step"])
        if marked:
            file["outcome"].attrs.create("_Encoding", np.bytes_(b"utf-8"))


def values(name, engine):
    try:
        with xarray.open_dataset(name, engine=engine) as dataset:
            return dataset["outcome"].values.tolist()
    except AttributeError as error:
        return str(error)


text = ["walked", "f\u00e4llt"]
seen = {(name, engine): values(name, engine) for name in ("marked.h5", "bare.h5") for engine in ("h5netcdf", "netcdf4")}
for case, got in seen.items():
    print(*case, "expected", text, "got", got)
expected = {
    ("marked.h5", "h5netcdf"): text,
    ("marked.h5", "netcdf4"): "'str' object has no attribute 'decode'",
    ("bare.h5", "h5netcdf"): [b"walked", "f\u00e4llt".encode()],
    ("bare.h5", "netcdf4"): text,
}
sys.exit(seen != expected)
PYTHON
