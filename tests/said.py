"""What is read from files, as text that can be compared."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from pydantic import BaseModel


def said(value: Any) -> str:
    """Anything that is read from a file, as text in which every bit of every number shows."""
    if isinstance(value, BaseModel):
        value = value.model_dump()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, dict):  # the order of a table's keys says nothing, in JSON and in TOML
        return str({key: said(each) for key, each in sorted(value.items(), key=str)})
    if isinstance(value, tuple | list):
        return str([said(each) for each in value])
    return repr(value)
