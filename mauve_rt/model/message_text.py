"""Definitions of messages as text, of C++ structs without a ROS message too."""

from collections.abc import Iterable

from mauve_rt._kernel import MessageShape, message_files
from mauve_rt.errors import MauveError
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.definitions import SEPARATOR, find_definition


def message_text(type_name: str, shapes: Iterable[MessageShape]) -> str:
    """The definition of a type and of those it uses: an installed message's, else one made from the struct.

    Raises:
        MauveError: there is neither.
    """
    try:
        return find_definition(type_name).text
    except TraceError as error:
        shape = next((shape for shape in shapes if shape.type == type_name), None)
        if shape is None:
            raise MauveError(str(error)) from error
    first, *inner = message_files(shape)
    parts = (f"{SEPARATOR}\nMSG: {file.name.replace('/msg/', '/')}\n{file.text}" for file in inner)
    return first.text + "".join(parts)
