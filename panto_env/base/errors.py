"""The error for invalid input of any kind, and warnings about accuracy, unusual values and plug-ins."""

from .shown import one_line


class InputError(ValueError):
    """Invalid input (action, argument or file): one sentence that says what is wrong and what to do."""

    def __init__(self, message: str = "") -> None:
        """message: printable in one line, whatever it quotes, such as a damaged file or a broken name."""
        super().__init__(one_line(message))


class AccuracyWarning(UserWarning):
    """Figures are less accurate than usual: one sentence that says why and by how much."""


class PlugInWarning(UserWarning):
    """A plug-in of another package is left out: one sentence that says which one and why."""


class UnusualWarning(UserWarning):
    """A value is valid but far from any usual one, as a wrong unit or sign makes it: one sentence."""
