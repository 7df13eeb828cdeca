"""Identify a pantograph from a rig's record, a CSV file, and compare it with the truth.

The record is made here: a plate moves the collector head of a known pantograph up and down at 0.3 to 4 Hz;
three displacement sensors and a load cell, with noise, record the motion. If you have a record, leave out
``write_rig_record``. `panto identify rig.csv --measured k1T=32992 m2=5 k2=14544` does the same.

    python examples/identify_from_csv.py

printed

    c1T: 12.22 N s/m (11.86 to 12.59), in truth 12.31
    c2: not determined by this record
    m3: 10.38 kg (10.38 to 10.38), in truth 10.38
    c3: 50.94 N s/m (50.88 to 51), in truth 50.92
    k3: 611.7 N/m (610.9 to 612.5), in truth 611.9
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from panto_env.catalog import load_pantograph
from panto_env.identification import (
    FREQUENCY_SWEEP,
    MEASURED,
    OUTPUT_ERROR,
    UNITS,
    Fit,
    add_noise,
    clean_record,
    identify,
    parameters_of,
    read_record,
    write_record,
)

TRUTH = parameters_of(load_pantograph("identified-2dof"))
KNOWN = {name: TRUTH[name] for name in MEASURED}  # weighed, or measured with a spring balance


def write_rig_record(path: Path) -> None:
    """Write the file that a rig would write: time, force and three displacements, 1000 rows per second."""
    write_record(add_noise(clean_record(FREQUENCY_SWEEP, TRUTH), np.random.default_rng(0)), path)


def identify_file(path: Path) -> Fit:
    """Parameters of the pantograph whose record the file holds, with their confidence."""
    found = identify(read_record(path), KNOWN, free_offset=True)
    if OUTPUT_ERROR not in found.fits:
        raise SystemExit(found.failures[OUTPUT_ERROR])
    return found.fits[OUTPUT_ERROR]


def main() -> None:
    """Print each parameter with its 95 % interval, and the truth."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.csv"
        write_rig_record(path)
        fit = identify_file(path)
    for name, value, (low, high) in zip(fit.names, fit.values, fit.interval, strict=True):
        if name in fit.undetermined:
            print(f"{name}: not determined by this record")
        else:
            print(f"{name}: {value:.4g} {UNITS[name]} ({low:.4g} to {high:.4g}), in truth {TRUTH[name]:.4g}")


if __name__ == "__main__":
    main()
