"""A YAML file with the place of every element, so that errors point at it."""

import os
import stat
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.yaml.text import MAX_BYTES, Node, YamlError, parse_yaml

Location = tuple[int | str, ...]
READ_TIMEOUT_S = 2.0


class YamlFile:
    """A parsed file: `data` in plain Python values, and `position()` of any element of it."""

    def __init__(self, path: str | Path, *, text: str | None = None, waits: bool = True) -> None:
        """Read and parse a file, or parse `text` in its place.

        With `waits=False` only a regular file will do, which can be read within 2 s: a pipe, or the disk of
        another machine, may keep its reader waiting for ever.

        Raises:
            ArchitectureFileError: no such file, too large, not UTF-8, not YAML, or a key given twice.
        """
        self._waits = waits
        self.path = Path(path)
        try:
            self._root = parse_yaml(self._read() if text is None else text)
        except YamlError as error:
            facts = {"code": error.code, "remedy": error.remedy}
            raise self.error(error.what, line=error.line, column=error.column, **facts) from None
        self.data = self._root.value

    def position(self, location: Location, *, key: bool = False) -> tuple[int, int]:
        """Line and column, from 1, of the deepest element of `location` that the file has.

        With `key`, of the last element's key rather than of its value.
        """
        position, node = (1, 1), self._root
        for index, part in enumerate(location):
            last = index == len(location) - 1
            found = _part(node, part)
            if found is None:
                break  # not in the file: its nearest ancestor is the place
            child, key_place = found
            is_scalar = child.children is None
            position = child.place if is_scalar and not (key and last) else key_place
            node = child
        return position

    def problem(self, location: Location, what: str, **facts: str) -> Problem:
        """A problem at an element of the file; `facts` as the fields of `Problem`."""
        line, column = self.position(location)
        return Problem(line=line, column=column, what=what, **facts)

    def key_problem(self, location: Location, what: str, **facts: str) -> Problem:
        """As problem(), but at the element's key rather than at its value."""
        line, column = self.position(location, key=True)
        return Problem(line=line, column=column, what=what, **facts)

    def error(self, what: str, *, line: int = 1, column: int = 1, **facts: str) -> ArchitectureFileError:
        """An error about the whole file or a given place in it."""
        return ArchitectureFileError(self.path, [Problem(line=line, column=column, what=what, **facts)])

    def _read_in_time(self) -> bytes:
        reading = _Reading(self._read_bytes)
        reading.start()
        return reading.result()

    def _read_bytes(self) -> bytes:
        opener = None if self._waits else _open_at_once
        with open(self.path, "rb", opener=opener) as file:
            if not self._waits and not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                what, remedy = "not a regular file", "copy its contents into one"
                raise self.error(what, expected="a regular file", code="io", remedy=remedy)
            return file.read(MAX_BYTES + 1)

    def _read(self) -> str:
        try:
            raw = self._read_bytes() if self._waits else self._read_in_time()
        except OSError as error:
            reason = error.strerror or str(error)
            raise self.error(f"cannot read the file: {reason}", code="io", remedy="check the path") from None
        if len(raw) > MAX_BYTES:
            raise self.error("the file is too large", expected=f"at most {MAX_BYTES} bytes", code="io")
        try:
            return raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            before = error.object[: error.start].decode("utf-8")
            line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
            remedy = "save it as UTF-8"
            raise self.error(
                "not text in UTF-8", line=line, column=column, code="io", remedy=remedy
            ) from None


class _Reading(threading.Thread):
    """Reads a file, or finds out why not; where the disk hangs it stays behind."""

    def __init__(self, read: Callable[[], bytes]) -> None:
        super().__init__(daemon=True)
        self._read = read
        self._raw = b""
        self._error: BaseException | None = TimeoutError(f"it was not read within {READ_TIMEOUT_S:g} s")

    def run(self) -> None:
        try:
            self._raw = self._read()
            self._error = None
        except BaseException as error:  # noqa: BLE001 - handed to who waits
            self._error = error

    def result(self) -> bytes:
        self.join(READ_TIMEOUT_S)
        if self._error is not None:
            raise self._error
        return self._raw


def _open_at_once(path: str, flags: int) -> int:
    """Opens without waiting for the other end of a pipe."""
    return os.open(path, flags | os.O_NONBLOCK)


def _part(node: Node, part: int | str) -> tuple[Node, tuple[int, int]] | None:
    """A value in another, and the place of its key, or of itself in a list."""
    children = node.children
    if isinstance(children, Mapping) and isinstance(part, str) and part in children:
        return children[part], node.key_places[part]
    if children is not None and not isinstance(children, Mapping) and isinstance(part, int):
        return (children[part], children[part].place) if 0 <= part < len(children) else None
    return None
