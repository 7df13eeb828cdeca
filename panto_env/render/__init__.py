"""Moving pictures: frames of a run or an episode, films, a window."""

from .moment import Moment, moment_of

__all__ = ["Moment", "moment_of"]
