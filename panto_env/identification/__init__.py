"""Identification of a pantograph from records of a rig (paper 1, sections 2 to 4), and beyond."""

from .band import band_limited, excited_band
from .coverage import Trials, run_trials
from .equation_error import FILTERED, PRINTED, equations, fit_equation_error, three_points
from .experiments import EXPERIMENTS, FREQUENCY_SWEEP, Excitation, add_noise, clean_record
from .fit import Fit
from .methods import METHODS, Identification, identify
from .model import IDENTIFIED, MEASURED, UNITS, parameters_of
from .output_error import OUTPUT_ERROR, fit_output_error
from .pantograph_file import write_pantograph
from .performance import Match, force_matches, matches
from .record import Record
from .record_file import read_record, write_record

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
