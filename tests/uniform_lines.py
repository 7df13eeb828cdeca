"""Lines of the catalogue whose spans are alike."""

from panto_env.catalog import available, load_catenary
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData

_LINES = [load_catenary(name) for name in available("catenary")]
UNIFORM = [line.name for line in _LINES if isinstance(line, FlexibleCatenaryData) and not line.sequence]
"""Names of the flexible ones."""
