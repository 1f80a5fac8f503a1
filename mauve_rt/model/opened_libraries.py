"""The libraries that this process has open, by the names that other libraries need them by."""

import ctypes
import os
from pathlib import Path


class _LinkMap(ctypes.Structure):
    """The begin of glibc's struct link_map."""


_LinkMap._fields_ = [
    ("l_addr", ctypes.c_size_t),
    ("l_name", ctypes.c_char_p),
    ("l_ld", ctypes.c_void_p),
    ("l_next", ctypes.POINTER(_LinkMap)),
]

_RTLD_DI_LINKMAP = 2


def opened_libraries() -> dict[str, str]:
    """The path that the loader opened each library by, by file name; of two of one name the first."""
    program = ctypes.CDLL(None)
    where = ctypes.POINTER(_LinkMap)()
    handle = ctypes.c_void_p(program._handle)  # noqa: SLF001 - ctypes has no other name for it
    if program.dlinfo(handle, _RTLD_DI_LINKMAP, ctypes.byref(where)) != 0:
        return {}
    found: dict[str, str] = {}
    while where:
        path = os.fsdecode(where.contents.l_name or b"")
        if path:
            found.setdefault(Path(path).name, str(Path(path).absolute()))
        where = where.contents.l_next
    return found
