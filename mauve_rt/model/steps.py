"""Steps of a transaction as files have them: rules of a supervisor, and `mauve reconfigure`.

- {kind: add_resource, target: goal, value: {kind: shared_data, type: geometry_msgs/msg/Point}}
- {kind: connect, target: guidance, name: goal, value: goal.read}
- {kind: set_property, target: guidance, name: path_step, value: 0.5}
- {kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}
"""

import json
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.model.schema import Identifier
from mauve_rt.model.words import shown
from mauve_rt.model.yaml_file import Location, YamlFile

StepKind = Literal[
    "replace_core",
    "replace_fsm",
    "replace_shell",
    "set_property",
    "connect",
    "disconnect",
    "add_component",
    "remove_component",
    "add_resource",
    "remove_resource",
    "start",
    "stop",
]
STEP_KINDS: tuple[str, ...] = get_args(StepKind)
_NEED_NAME = ("replace_core", "replace_fsm", "replace_shell", "set_property", "connect", "disconnect")
_NEED_VALUE = ("connect", "add_component", "add_resource")  # a property's value may be an empty text


class Step(BaseModel):
    """One step of a transaction, as mauve_msgs/msg/ReconfigurationStep."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    kind: StepKind
    target: Identifier
    name: str = ""
    value: str = ""  # YAML text

    @field_validator("value", mode="before")
    @classmethod
    def _text_of_a_value(cls, value: object) -> object:
        return json.dumps(value) if isinstance(value, bool | int | float | dict) else value

    @model_validator(mode="after")
    def _has_what_it_needs(self) -> "Step":
        if not self.name and self.kind in _NEED_NAME:
            raise ValueError(f"a step of kind '{self.kind}' needs a name")
        if not self.value and self.kind in _NEED_VALUE:
            raise ValueError(f"a step of kind '{self.kind}' needs a value")
        return self


_STEPS = TypeAdapter(Annotated[list[Step], Field(min_length=1)])


def load_steps(path: str | Path, *, text: str | None = None) -> list[Step]:
    """The steps of a file, or of `text` in its place.

    Raises:
        ArchitectureFileError: it cannot be read, is no YAML or no list of steps.
    """
    file = YamlFile(path, text=text)
    try:
        return _STEPS.validate_python(file.data)
    except ValidationError as error:
        problems = [form_problem(file, item) for item in error.errors(include_url=False)]
        raise ArchitectureFileError(file.path, problems) from None


def form_problem(file: YamlFile, item: Any) -> Problem:
    """What pydantic found wrong, in words for who wrote the file."""
    kind, location = item["type"], tuple(item["loc"])
    element = dotted(location)
    if kind == "missing" and location[-1] == "silence":
        return file.problem(location, f"{element[:-8]} has no known condition", expected="silence")
    if kind == "missing":
        return file.problem(location, f"{element} is missing")
    if kind == "extra_forbidden":
        return file.key_problem(location, f"{element} is no known key")
    if kind == "expected":
        text, found = item["ctx"]["text"], shown(item["input"])
        return file.problem(location, f"bad {element}", expected=text, found=found)
    message = item["msg"].removeprefix("Value error, ")
    text = message[:1].lower() + message[1:]
    return file.problem(location, f"{element or 'the file'}: {text}", found=shown(item["input"]))


def dotted(location: Location) -> str:
    """`rules[0].when.silence`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".")
