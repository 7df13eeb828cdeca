"""Characters that an output cannot show, in others that it can: nothing computed is lost to an encoding."""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata

HANDLER = "panto-plain"
PLAIN = {
    "−": "-", "–": "-", "—": "-", "‑": "-", "…": "...", "≤": "<=", "≥": ">=", "≈": "~", "±": "+-",
    "×": "x", "·": "*", "√": "sqrt", "∞": "inf", "→": "->", "←": "<-", "↑": "^", "↓": "v", "‘": "'",
    "’": "'", "“": '"', "”": '"', "°": " deg", "α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta",
    "Δ": "Delta", "ε": "epsilon", "ζ": "zeta", "η": "eta", "θ": "theta", "λ": "lambda", "μ": "u",
    "µ": "u", "ν": "nu", "π": "pi", "ρ": "rho", "σ": "sigma", "Σ": "Sigma", "τ": "tau", "φ": "phi",
    "ω": "omega", "Ω": "Ohm", "ß": "ss", "ø": "o", "Ø": "O", "æ": "ae",
}  # fmt: skip
"""What stands for a character that has no plain form of its own in Unicode's tables."""
BOXES, BLOCKS = range(0x2500, 0x2580), range(0x2580, 0x25A0)
"""Lines of tables and frames, and what bars and pictures in a terminal are made of."""


def show_always() -> None:
    """From here on standard output and error show what their encoding cannot as plain characters."""
    codecs.register_error(HANDLER, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def shows_all(stream: object) -> bool:
    """Whether a stream can show every character: its encoding is one of Unicode's, or none."""
    return str(getattr(stream, "encoding", None) or "utf").lower().startswith("utf")


def _plain(error: UnicodeError) -> tuple[str, int]:
    """What the codec writes instead of characters that it cannot."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(plain, error.object[error.start : error.end])), error.end


def plain(character: str) -> str:
    """A character in those of ASCII."""
    if character in PLAIN:
        return PLAIN[character]
    code = ord(character)
    if code in BOXES:
        return "-" if character in "─━═╌┄┈╴╶╸╺" else "|" if character in "│┃║╎┆┊╵╷╹╻" else "+"
    if code in BLOCKS:
        return "#"
    # Accents come off, raised and lowered digits come down.
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode() or "?"
