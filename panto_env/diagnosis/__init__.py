"""Diagnosis of the overhead line from the estimated contact force (paper 2, section 4.2)."""

from .diagnosis import Diagnosis, Finding, diagnose, diagnose_records
from .force import estimated_force
from .kinds import KINDS, Classifier

__all__ = ["KINDS", "Classifier", "Diagnosis", "Finding", "diagnose", "diagnose_records", "estimated_force"]
