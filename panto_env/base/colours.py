"""Colours of all pictures, distinct with any colour vision (Okabe, Ito: "Color universal design", 2008)."""

BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"
PURPLE, ORANGE, SKY, BROWN = "#b0528a", "#e69f00", "#56b4e9", "#7a4b2a"
SERIES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BROWN)
"""Colours of several series, in this order."""
LIMIT = "0.1"
"""Colour of limits: nearly black, unlike all series."""
SUPPORT = "0.55"
"""Colour of the lines at supports, darker than a grid."""
HIGH_IS_BAD, LOW_IS_BAD = "cividis", "cividis_r"
"""Colour maps of Matplotlib: in both dark is good and bright is bad."""


def series_colour(number: int) -> str:
    """Colour of a series by its number; after the seventh the colours repeat."""
    return SERIES[number % len(SERIES)]
