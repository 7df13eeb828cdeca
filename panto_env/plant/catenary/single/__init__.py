"""A single wire on point supports (tram, trolley, depot), and with a tension of 0 a conductor rail."""

from ..protocol import CatenaryKind
from . import step as step
from .model import Single, clear_spans, spacing, warn_if_short
from .schema import SingleData, check_sag

__all__ = ["KIND", "Single", "SingleData", "spacing"]

KIND = CatenaryKind(SingleData, Single, check_sag, clear_spans, warn_if_short, several_collectors=True)
