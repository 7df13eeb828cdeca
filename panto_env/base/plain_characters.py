"""Replacement of characters that an output's encoding cannot show, so that no result is lost."""

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
    "ω": "omega", "Ω": "Ohm", "ß": "ss", "ø": "o", "Ø": "O", "æ": "ae", "‰": "per mille",
}  # fmt: skip
"""Replacements of characters without a plain form in Unicode's tables."""
BOXES, BLOCKS = range(0x2500, 0x2580), range(0x2580, 0x25A0)
"""Characters of lines of tables and frames, and of bars and pictures in a terminal."""


def show_always() -> None:
    """Let standard output and error replace characters that their encoding lacks by plain ones."""
    codecs.register_error(HANDLER, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def shows_all(stream: object) -> bool:
    """Whether a stream can show every character: it has one of Unicode's encodings, or none."""
    return str(getattr(stream, "encoding", None) or "utf").lower().startswith("utf")


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Error handler of a codec: plain characters instead of those that it cannot encode."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(plain, error.object[error.start : error.end])), error.end


def plain(character: str) -> str:
    """A character replaced by ASCII."""
    if character in PLAIN:
        return PLAIN[character]
    code = ord(character)
    if code in BOXES:
        return "-" if character in "─━═╌┄┈╴╶╸╺" else "|" if character in "│┃║╎┆┊╵╷╹╻" else "+"
    if code in BLOCKS:
        return "#"
    # Accents are removed, superscript and subscript digits become normal ones.
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode() or "?"
