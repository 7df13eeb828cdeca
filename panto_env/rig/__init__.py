"""The rig beside the line itself, its stability, and its computer: against the clock, and as a program."""

from .computer import RigComputer

__all__ = ["RigComputer"]
