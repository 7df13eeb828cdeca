"""The three ways to identify a record, by name, on the same data."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..base.errors import InputError
from .band import excited_band
from .equation_error import FILTERED, PRINTED, fit_equation_error
from .fit import Fit
from .model import Parameters, check_known
from .output_error import OUTPUT_ERROR, fit_output_error
from .plausibility import check_record
from .record import Record

METHODS = (PRINTED, FILTERED, OUTPUT_ERROR)


@dataclass(frozen=True)
class Identification:
    """What each method made of a record."""

    band: float  # Hz
    fits: dict[str, Fit]  # by method
    failures: dict[str, str]  # why a method found nothing, by method


def identify(
    record: Record, known: Parameters, *, band: float | None = None, free_offset: bool = False
) -> Identification:
    """Identify by paper 1's equations as printed, by the same on low-passed data, and by output error.

    known: at least k1T (N/m), m2 (kg) and k2 (N/m). band: highest frequency of the excitation (Hz), found
    from the plate's motion unless given. free_offset: only motion counts, not where the springs carry
    nothing. A method that finds nothing says why in ``failures``.

    Raises InputError, with the likely mistake, for a record or known values that can't be those of a rig.
    """
    check_record(record, check_known(known))
    if band is not None and not (math.isfinite(band) and band > 0):
        raise InputError(f"The band must be a frequency above 0 Hz, not {band:g}.")
    band = excited_band(record) if band is None else band
    runs: dict[str, Callable[[], Fit]] = {
        PRINTED: lambda: fit_equation_error(record, known, free_offset=free_offset),
        FILTERED: lambda: fit_equation_error(record, known, band=band, free_offset=free_offset),
        OUTPUT_ERROR: lambda: fit_output_error(record, known, band=band, free_offset=free_offset),
    }
    fits: dict[str, Fit] = {}
    failures: dict[str, str] = {}
    for method, run in runs.items():
        try:
            fits[method] = run()
        except InputError as error:
            failures[method] = str(error)
    return Identification(band, fits, failures)
