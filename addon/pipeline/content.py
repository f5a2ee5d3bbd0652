"""Whether two things hold the same, to the bit."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def have_same_content(a: object, b: object) -> bool:
    """Of two dataclasses, all fields; of arrays, type, shape and bytes: NaN is the same as itself, and 0 is not -0."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and _bytes(a) == _bytes(b)
    if is_dataclass(a):
        return all(have_same_content(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(have_same_content, a, b))
    return bool(a == b)


def _bytes(array: np.ndarray[Any, Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
