"""The one error that bad input of any kind raises, and the warnings of ours."""


class InputError(ValueError):
    """Bad input (action, argument or file): one sentence that says what was wrong and what to do."""

    def __init__(self, message: str = "") -> None:
        """Letters that no encoding has, as a broken file name may hold, are escaped: it can be printed."""
        super().__init__(message.encode("utf-8", "backslashreplace").decode("utf-8"))


class AccuracyWarning(UserWarning):
    """Figures are less accurate than usual: one sentence that says why and by how much."""


class UncheckedWarning(UserWarning):
    """A file holds no checksum, so damage to it would not be noticed: one sentence that names it."""
