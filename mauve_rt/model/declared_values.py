"""Values by the type that a property or parameter declares, not by how their text looks."""

from typing import Any

from mauve_rt.yaml.scalars import plain_value
from mauve_rt.yaml.text import plain_scalar, read_yaml


def read_declared(text: str, type_name: str) -> Any:
    """The value of a YAML text for what is declared as `bool`, `int`, `float` or `str`.

    `007` is text where text is declared, and `"5e-06"` a number where a number is.

    Raises:
        YamlError: the text is no YAML.
    """
    value = read_yaml(text)
    if type_name == "str" and not isinstance(value, str):
        scalar = plain_scalar(text)
        return value if scalar is None else scalar
    return declared_value(value, type_name)


def declared_value(value: Any, type_name: str) -> Any:
    """A value whose text reads as the declared type, in that type; else the value as it is."""
    if isinstance(value, str) and type_name != "str":
        try:
            read = plain_value(value.strip())
        except ValueError:
            return value
        is_number = isinstance(read, int | float) and not isinstance(read, bool)
        return read if (isinstance(read, bool) if type_name == "bool" else is_number) else value
    return value
