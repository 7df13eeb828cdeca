"""Pictures of what moves: frames of a run or an episode, films of them, a window."""

from .moment import Moment, moment_of

__all__ = ["Moment", "moment_of"]
