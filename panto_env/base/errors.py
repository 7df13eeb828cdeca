"""The one error that bad input of any kind raises."""


class InputError(ValueError):
    """Bad input (action, argument or file): one sentence that says what was wrong and what to do."""
