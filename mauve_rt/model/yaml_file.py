"""A YAML file with the place of every element, so that errors point at it."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.model.words import shown

Location = tuple[int | str, ...]
MAX_BYTES = 1_000_000


class YamlFile:
    """A parsed file: `data` in plain Python values, and `position()` of any element of it."""

    def __init__(self, path: str | Path, *, text: str | None = None) -> None:
        """Read and parse a file, or parse `text` in its place.

        Raises:
            ArchitectureFileError: no such file, too large, not UTF-8, not YAML, or a key given twice.
        """
        self.path = Path(path)
        self._document = self._parse(self._read() if text is None else text)
        try:
            self.data = _Plain().value(self._document)
        except (RecursionError, OverflowError):
            raise self.error(
                "the file is nested too deeply", remedy="do its aliases refer to each other?"
            ) from None

    def position(self, location: Location, *, key: bool = False) -> tuple[int, int]:
        """Line and column, from 1, of the deepest element of `location` that the file has.

        With `key`, of the last element's key rather than of its value.
        """
        position = (1, 1)
        node = self._document
        for index, part in enumerate(location):
            marks = getattr(node, "lc", None)
            last = index == len(location) - 1
            try:
                if marks is None:
                    break
                if isinstance(node, Mapping):
                    at_value = not (key and last) and _is_scalar(node[part])
                    line, column = marks.value(part) if at_value else marks.key(part)
                else:
                    line, column = marks.item(part)
                node = node[part]
            except (KeyError, IndexError, TypeError):
                break  # not in the file, or from a merged mapping: its nearest ancestor is the place
            position = (line + 1, column + 1)
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

    def _read(self) -> str:
        try:
            with self.path.open("rb") as file:
                raw = file.read(MAX_BYTES + 1)
        except OSError as error:
            reason = error.strerror or str(error)
            raise self.error(f"cannot read the file: {reason}", code="io", remedy="check the path") from None
        if len(raw) > MAX_BYTES:
            raise self.error("the file is too large", expected=f"at most {MAX_BYTES} bytes", code="io")
        try:
            return raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            column = error.start - raw.rfind(b"\n", 0, error.start)
            raise self.error("not text in UTF-8", line=line, column=column, code="io") from None

    def _parse(self, text: str) -> Any:
        try:
            return YAML(typ="rt").load(io.StringIO(text))
        except DuplicateKeyError as error:
            line, column = _place(error)
            problem = (error.problem or "").split('"')
            name = problem[1] if len(problem) > 1 else "?"
            text = f"key '{name}' given twice"
            raise self.error(
                text, line=line, column=column, code="duplicate_name", remedy="remove one"
            ) from None
        except MarkedYAMLError as error:
            line, column = _place(error)
            reasons = (
                (error.context, error.problem)
                if (error.problem or "").startswith("but ")
                else (error.problem,)
            )
            reason = " ".join(reason for reason in reasons if reason) or "bad syntax"
            raise self.error(f"not YAML: {reason}", line=line, column=column) from None
        except (YAMLError, ValueError) as error:  # ValueError: e.g. a date such as 2001-99-99
            raise self.error(f"not YAML: {str(error).splitlines()[0]}") from None
        except RecursionError:
            raise self.error("the file is nested too deeply") from None


class _Plain:
    """Plain Python values of a round-trip document; a key that is no text becomes text."""

    MAX_NODES = 200_000  # what aliases of aliases may grow to

    def __init__(self) -> None:
        self._nodes = 0

    def value(self, node: Any) -> Any:
        self._nodes += 1
        if self._nodes > self.MAX_NODES:
            raise OverflowError
        if isinstance(node, Mapping):
            return {
                key if isinstance(key, str) else shown(key): self.value(item) for key, item in node.items()
            }
        if isinstance(node, Sequence) and not isinstance(node, str | bytes):
            return [self.value(item) for item in node]
        for kind in (bool, int, float, str):
            if isinstance(node, kind):
                return kind(node)
        return None if node is None else str(node)


def _is_scalar(node: Any) -> bool:
    return not isinstance(node, Mapping | list)


def _place(error: MarkedYAMLError) -> tuple[int, int]:
    mark = error.problem_mark or error.context_mark
    return (mark.line + 1, mark.column + 1) if mark else (1, 1)
