"""Types as a model writes them: `float64`, `Point2D[<=64]`, `string<=32`, `geometry_msgs/msg/Point`.

A port may have a message of an action as well, `mauve_msgs/action/DriveTo_Goal`.
"""

import re
from dataclasses import dataclass

NUMBERS = {
    "bool": "bool",
    "float32": "float",
    "float64": "double",
    **{f"{sign}int{bits}": f"std::{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
"""Numbers of .msg files, and what they are in C++."""

EXPECTED = (
    "a number such as float64, string<=32, a type of the model, package/Name of another model, "
    "package/msg/Name; a list as float64[<=3]"
)
PATTERN = (
    r" *(?:string *<= *(?P<text>\d+)|(?P<item>[A-Za-z]\w*(?:/\w+){0,2}))"
    r" *(?P<list>\[ *(?P<most><=)? *(?P<count>\d*) *\])? *"
)
_FORM = re.compile(PATTERN, re.ASCII)


@dataclass(frozen=True)
class TypeName:
    """A type, taken apart.

    Attributes:
        text: as the model has it, without spaces.
        item: a number, `string`, a type of the model, package/Name of another model, or package/msg/Name.
        length: the most characters of a string; None: no string, or one without a bound.
        count: the elements of a list; None: it is no list, or has no bound.
        is_list: whether it is one.
        is_fixed: whether a list has exactly `count` elements.

    """

    text: str
    item: str
    length: int | None
    count: int | None
    is_list: bool
    is_fixed: bool

    @property
    def is_of_model(self) -> bool:
        """Whether it is package/Name: a type of another package's model."""
        return self.item.count("/") == 1

    @property
    def is_bounded(self) -> bool:
        """Whether its size has a limit."""
        return (self.item != "string" or bool(self.length)) and (not self.is_list or bool(self.count))


def parse_type(text: str) -> TypeName | None:
    """A type, taken apart; None where the text is none."""
    found = _FORM.fullmatch(text)
    if found is None:
        return None
    return TypeName(
        text=text.replace(" ", ""),
        item=found["item"] or "string",
        length=int(found["text"]) if found["text"] else None,
        count=int(found["count"]) if found["count"] else None,
        is_list=found["list"] is not None,
        is_fixed=found["list"] is not None and found["most"] is None,
    )
