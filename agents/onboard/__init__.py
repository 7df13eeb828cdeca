"""Policies for a train's controller: as C, as an FMI unit, as a network in ONNX, and what a step costs."""

from .export import Exported, Variable, exported
from .fmu import write_fmu
from .onnx import write_onnx

__all__ = ["Exported", "Variable", "exported", "write_fmu", "write_onnx"]
