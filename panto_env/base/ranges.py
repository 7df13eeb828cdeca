"""Numbers within a range, for the values of schemas; ranges are wide enough for anything real."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any, get_args

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema


@dataclass(frozen=True)
class Between:
    """Annotation of a ``float`` or ``int`` that must lie from ``low`` to ``high``, both included.

    Text, truth values, nan and infinity are refused. The message names the range and the unit, so that a
    value in kN or mm is noticed.
    """

    low: float
    high: float
    unit: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """A check before the type's own: pydantic would accept text and truth values as numbers."""
        check = partial(self._checked, whole=source is int)
        return core_schema.no_info_before_validator_function(check, handler(source))

    def _checked(self, value: Any, whole: bool) -> Any:
        usable = isinstance(value, Real) and not isinstance(value, bool)
        if usable and self.low <= value <= self.high and not (whole and value != math.floor(value)):
            return int(value) if whole else float(value)
        number = "a whole number" if whole else "a number"
        unit = f" {self.unit}" if self.unit else ""
        raise PydanticCustomError("range", f"must be {number} from {self.low:,g} to {self.high:,g}{unit}")


def ranges_of(annotation: Any) -> Iterator[Between]:
    """The ranges of an annotation and of its parts, such as the numbers of a tuple."""
    for part in get_args(annotation):
        if isinstance(part, Between):
            yield part
        yield from ranges_of(part)
