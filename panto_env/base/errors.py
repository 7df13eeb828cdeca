"""The one error that bad input of any kind raises, and our one warning."""

from .shown import one_line


class InputError(ValueError):
    """Bad input (action, argument or file): one sentence that says what was wrong and what to do."""

    def __init__(self, message: str = "") -> None:
        """Whatever the message quotes, a damaged file or a broken name, it can be printed in one line."""
        super().__init__(one_line(message))


class AccuracyWarning(UserWarning):
    """Figures are less accurate than usual: one sentence that says why and by how much."""
