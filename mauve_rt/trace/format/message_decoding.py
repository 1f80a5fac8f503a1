"""Messages of any type, from CDR, by the definition that a bag stores beside them: rosbags decodes them.

Not by installed message classes: a bag can be read where none are. What stays ours are bounds: rosbags writes
and compiles code for each field, and for each element of an array of fixed length that holds no numbers.
"""

import dataclasses
import struct
from collections.abc import Mapping
from typing import Any

from mauve_rt.trace.errors import libraries_missing
from mauve_rt.trace.format.message_layout import Layout, layout_of

try:
    from rosbags.interfaces import Nodetype
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as error:
    raise libraries_missing(error) from error

_ENCAPSULATION_BYTES = 4
_MAX_TEXT = 256 << 10  # blank lines of so many bytes take the parser six seconds; a ROS type has some 30 KB
_MAX_FIELDS = 2_000  # take a second to compile; a ROS type has some hundred


class Decoder:
    """Reads messages of one type. Objects have the message's fields; arrays of numbers are numpy's."""

    def __init__(self, type_name: str, definition: str) -> None:
        """Take in a definition: the .msg file, and those of the types it uses.

        Raises:
            ValueError: it does not tell all types that it uses, or one is not read (wstring).

        """
        if len(definition) > _MAX_TEXT:
            msg = f"the definition has {len(definition):,} characters, expected at most {_MAX_TEXT:,}"
            raise ValueError(msg)
        try:
            types = get_types_from_msg(definition, type_name)
            _check(types)
            self._store: Any = get_typestore(Stores.EMPTY)
            self._store.register(types)
            self._store.types |= {name: self._plain(name) for name in types}
            self.type_name = next(iter(types))
            self._type = self._store.get_msgdef(self.type_name)
        except (MemoryError, ValueError):
            raise
        except KeyError as error:
            msg = f"the definition does not tell the type {error.args[0]}"
            raise ValueError(msg) from error
        except RecursionError as error:
            msg = "a type of the definition is defined by itself, or nested too deeply"
            raise ValueError(msg) from error
        except Exception as error:  # the code that rosbags writes of a definition can fail in any way
            msg = f"the definition cannot be read ({' '.join(str(error).split())[:200]})"
            raise ValueError(msg) from error

    def _plain(self, name: str) -> type:
        """Return a class of the fields alone: in rosbags' own constants and `__msgtype__` are fields, too."""
        count = len(self._store.fielddefs[name][1])
        names = [one.name for one in dataclasses.fields(self._store.types[name])[:count]]
        return dataclasses.make_dataclass(name.rpartition("/")[2], names)

    def layout(self, data: bytes, *, most_elements: int) -> Layout | None:
        """Return where the numbers of a message are; None where it cannot be told."""
        return layout_of(self._store, self.type_name, data, most_elements=most_elements)

    def decode(self, data: bytes) -> Any:
        """Return a message.

        Raises:
            ValueError: the bytes are no such message.

        """
        orders = {b"\0\0": self._type.deserialize_cdr_be, b"\0\1": self._type.deserialize_cdr_le}
        read = orders.get(bytes(data[:2]))
        if read is None:
            msg = f"expected plain CDR (00 00 or 00 01), found {data[:2].hex(' ')}"
            raise ValueError(msg)
        try:
            # Not deserialize_cdr(): it refuses the room that DDS leaves behind an empty sequence at the end.
            message, _ = read(memoryview(data)[_ENCAPSULATION_BYTES:], 0, self._type.cls, self._store)
        except (SerdeError, struct.error, ValueError) as error:
            msg = f"{len(data)} bytes are no whole message ({error})"
            raise ValueError(msg) from error
        return message


def _check(types: Mapping[str, Any]) -> None:
    """Refuse definitions whose code would be huge, or whose messages endless.

    Raises:
        ValueError: to say why.

    """
    count = 0
    for _, fields in types.values():
        for _, (kind, inner) in fields:
            count += 1
            if kind == Nodetype.ARRAY:
                (element, of), length = inner
                if length < 1:
                    msg = "the definition has an array of no elements"
                    raise ValueError(msg)
                is_number = element == Nodetype.BASE and of[0] != "string"
                count += 0 if is_number else length
    if count > _MAX_FIELDS:
        msg = f"the definition has {count:,} fields, expected at most {_MAX_FIELDS:,}"
        raise ValueError(msg)
