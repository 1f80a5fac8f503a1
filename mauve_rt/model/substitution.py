"""What architecture files may write instead of a value that differs from machine to machine.

- `$(share PACKAGE)` - the package's share folder, found through the ament index;
- `$(namespace)` - the executor's namespace, `$(name)` - its last part;
- `$(peers)` - the executor's peers, separated by commas;
- a frame begins with no slash, also where it begins with `$(namespace)`;
- a relative path in a text property named `map` or ending in `_file` is relative to the architecture file.
"""

import re
from pathlib import Path
from typing import Protocol

from mauve_rt.model.schema import PropertyValue
from mauve_rt.parts.ament_index import share_folder

_PLACE = re.compile(r"\$\(([^()]*)\)")


class Surroundings(Protocol):
    """What the places stand for."""

    namespace: str
    peers: list[str]


def substituted_property(
    name: str, value: PropertyValue, *, folder: Path, model: Surroundings
) -> PropertyValue:
    """The value of a property with its places replaced and its path made absolute.

    Raises:
        LookupError: an unknown place or package, in words.
    """
    if not isinstance(value, str):
        return value
    text = _PLACE.sub(lambda match: _replacement(match[1].split(), model), value)
    if text and (name == "map" or name.endswith("_file")):
        return str((folder / text).resolve())
    return text


def substituted_frame(text: str, model: Surroundings) -> str:
    """A frame with its places replaced.

    Raises:
        LookupError: nothing is left of it, in words.
    """
    frame = _PLACE.sub(lambda match: _replacement(match[1].split(), model), text).lstrip("/")
    if not frame:
        message = f"{text}, which is empty in namespace '{model.namespace}'"
        raise LookupError(message)
    return frame


def _replacement(words: list[str], model: Surroundings) -> str:
    match words:
        case ["share", package]:
            folder = share_folder(package)
            if folder is None:
                message = f"$(share {package}), a package that is not installed"
                raise LookupError(message)
            return str(folder)
        case ["namespace"]:
            return model.namespace
        case ["name"]:
            return model.namespace.rsplit("/", 1)[-1]
        case ["peers"]:
            return ",".join(model.peers)
        case _:
            message = f"$({' '.join(words)}); known: $(share PACKAGE), $(namespace), $(name), $(peers)"
            raise LookupError(message)
