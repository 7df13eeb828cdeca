"""Three-span catenary (paper 2, section 2.1, Eqs 1-6): one equivalent wire, in modal form.

The wire is anchored at both ends of the three spans and stands on springs K_S at the two supports
between them. The pantograph is always in the central span: when it leaves it, the deflection of the
second and third span is moved to the first and second, the third starts at rest, and the modal
coordinates follow by least squares.
"""

from ..protocol import CatenaryKind
from . import step as step
from .build import ThreeSpan
from .schema import ThreeSpanData

__all__ = ["KIND", "ThreeSpan", "ThreeSpanData"]

KIND = CatenaryKind(ThreeSpanData, ThreeSpan)
