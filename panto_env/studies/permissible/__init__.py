"""Speeds at which a train keeps all requirements on a line, with control and without."""

from .scan import PASSIVE, USUAL, Answer, Scan, scan, verified

__all__ = ["PASSIVE", "USUAL", "Answer", "Scan", "scan", "verified"]
