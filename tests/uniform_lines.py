"""Lines of the catalogue whose spans are alike, with one contact wire."""

from panto_env.catalog import available, load_catenary
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData

_LINES = [load_catenary(name) for name in available("catenary")]
_FLEXIBLE = [line for line in _LINES if isinstance(line, FlexibleCatenaryData)]
UNIFORM = [line.name for line in _FLEXIBLE if not line.sequence and line.contact_wires == 1]
"""Names of the flexible ones."""
