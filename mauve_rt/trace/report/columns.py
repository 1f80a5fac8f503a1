"""Columns of numbers in a page: differences, byte planes, deflate, base64.

The page's own script (static/columns.js) undoes it. Neighbouring times differ little and their high bytes
are alike, so that an execution of a state costs about five bytes of the page.
"""

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

_TYPES = (("u1", 0, 2**8 - 1), ("u2", 0, 2**16 - 1), ("i4", -(2**31), 2**31 - 1))
_FLOAT = "float"
_LARGEST = 2**53
"""JavaScript's numbers are exact up to here: 104 days in ns."""
_EFFORT = 6


@dataclass
class Columns:
    """Collects columns of integers; `add` returns the number under which the page finds one."""

    described: list[list[Any]] = field(default_factory=list)
    """Per column: type, length, first value of a column of differences (else null). `float` has NaN."""
    _planes: list[bytes] = field(default_factory=list)

    def add(self, values: npt.NDArray[Any], *, differences: bool = False) -> int:
        """Append a column; with `differences` only the steps between its values are kept.

        Raises:
            ValueError: a value is over 2**53.

        """
        column = np.asarray(values, np.int64)
        if len(column) and max(abs(int(column.min())), abs(int(column.max()))) > _LARGEST:
            raise ValueError("a column of the report holds a value over 2**53, which no browser keeps exact")
        first = int(column[0]) if differences and len(column) else None
        if differences:
            column = np.diff(column, prepend=column[:1])
        return self._store(column, _smallest_type(column), first)

    def add_floats(self, values: npt.NDArray[np.float64]) -> int:
        """Append a column of numbers of any size, NaN and infinities among them."""
        return self._store(np.asarray(values, np.float64), _FLOAT, None)

    def _store(self, column: npt.NDArray[Any], code: str, first: int | None) -> int:
        self.described.append([code, len(column), first])
        stored = column.astype(_numpy_type(code))
        self._planes.append(stored.view(np.uint8).reshape(-1, stored.itemsize).T.tobytes())
        return len(self.described) - 1

    def data(self) -> str:
        """All columns as one text: base64 of zlib's deflate."""
        return base64.b64encode(zlib.compress(b"".join(self._planes), _EFFORT)).decode()


def read_columns(described: list[list[Any]], data: str) -> list[npt.NDArray[Any]]:
    """Return the columns of a page, as its script reads them."""
    planes = zlib.decompress(base64.b64decode(data))
    columns = []
    at = 0
    for code, length, first in described:
        kind = _numpy_type(code)
        end = at + length * kind.itemsize
        block = np.frombuffer(planes[at:end], np.uint8).reshape(kind.itemsize, length)
        values = np.ascontiguousarray(block.T).view(kind).reshape(-1)
        values = values if code == _FLOAT else values.astype(np.int64)
        columns.append(values if first is None else first + np.cumsum(values))
        at = end
    return columns


def _numpy_type(code: str) -> np.dtype[Any]:
    return np.dtype("<f8" if code == _FLOAT else f"<{code}")


def _smallest_type(column: npt.NDArray[np.int64]) -> str:
    if not len(column):
        return "u1"
    lowest, highest = int(column.min()), int(column.max())
    return next((code for code, low, high in _TYPES if low <= lowest and highest <= high), "f8")
