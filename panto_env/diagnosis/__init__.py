"""Diagnosis of the overhead line from the estimated contact force (paper 2, section 4.2)."""

from .diagnosis import Diagnosis, Finding, diagnose, diagnose_records
from .features import KINDS, Classifier
from .passes import estimated_force

__all__ = ["KINDS", "Classifier", "Diagnosis", "Finding", "diagnose", "diagnose_records", "estimated_force"]
