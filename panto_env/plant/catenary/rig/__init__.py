"""Hardware-in-the-loop rig (paper 2, section 2): a pantograph on a cylinder that follows a computed line.

To the pantograph the cylinder is a wire. Its load cell samples the force; a line of any other kind that has
mass is computed under that force, from sample to sample; and the cylinder is commanded to the height of the
line's contact point, early enough to compensate its own lag and the delays. Everything else, from the
contact to a policy, is as on a line.
"""

from ..protocol import CatenaryKind
from . import step as step
from .build import LINES, Computer, Cylinder, LoadCell, Rig, RigData

__all__ = ["KIND", "Computer", "Cylinder", "LoadCell", "Rig", "RigData"]

KIND = CatenaryKind(RigData, Rig, check=lambda data: LINES[data.line.kind].check(data.line))
