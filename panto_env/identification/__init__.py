"""Identification of a pantograph from records of a rig (paper 1, sections 2 to 4), and beyond."""

from .experiments import EXPERIMENTS, FREQUENCY_SWEEP, Excitation, Trials, add_noise, clean_record, run_trials
from .methods import (
    FILTERED,
    METHODS,
    OUTPUT_ERROR,
    PRINTED,
    Identification,
    equations,
    fit_equation_error,
    fit_output_error,
    identify,
    three_points,
)
from .model import IDENTIFIED, MEASURED, UNITS, Fit, parameters_of
from .performance import Match, force_matches, matches, write_pantograph
from .record import Record, read_record, write_record
from .response import band_limited, excited_band

__all__ = [
    "EXPERIMENTS",
    "FILTERED",
    "FREQUENCY_SWEEP",
    "IDENTIFIED",
    "MEASURED",
    "METHODS",
    "OUTPUT_ERROR",
    "PRINTED",
    "UNITS",
    "Excitation",
    "Fit",
    "Identification",
    "Match",
    "Record",
    "Trials",
    "add_noise",
    "band_limited",
    "clean_record",
    "equations",
    "excited_band",
    "fit_equation_error",
    "fit_output_error",
    "force_matches",
    "identify",
    "matches",
    "parameters_of",
    "read_record",
    "run_trials",
    "three_points",
    "write_pantograph",
    "write_record",
]
