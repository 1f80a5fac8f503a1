"""Parts of JSON Schema 2020-12, of which the tables that check files make schemas for editors.

An editor's plug-in reads patterns as ECMA-262 does, with the flag `u`.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

JsonSchema = dict[str, Any]
Definitions = dict[str, JsonSchema]
"""Schemas that others refer to, by name."""
DIALECT = "https://json-schema.org/draft/2020-12/schema"
_CLASSES: Mapping[str, str] = {r"\w": "A-Za-z0-9_", r"\d": "0-9", r"\s": r" \t\n\r\f\v"}  # ASCII in both


def document(root: JsonSchema, definitions: Definitions, *, name: str) -> JsonSchema:
    """The schema of a file; `name` says of which."""
    head = {"$schema": DIALECT, "$id": f"urn:mauve_rt:schema:{name}:1", "title": f"MAUVE RT {name} file"}
    return {**head, **root, "$defs": definitions}


def reference(name: str) -> JsonSchema:
    """A reference to a definition."""
    return {"$ref": f"#/$defs/{name}"}


def defined(name: str, definitions: Definitions, make: Callable[[Definitions], JsonSchema]) -> JsonSchema:
    """A reference to a definition, which is made where there is none; it may have itself within."""
    if name not in definitions:
        definitions[name] = {}
        definitions[name] = make(definitions)
    return reference(name)


def mapping(
    properties: Mapping[str, JsonSchema], *, required: Iterable[str] = (), description: str = ""
) -> JsonSchema:
    """An object with these keys and no others."""
    words = {"description": description} if description else {}
    keys = {"properties": {**properties}, "required": [*required], "additionalProperties": False}
    return {"type": "object", **words, **keys}


def or_null(schema: JsonSchema) -> JsonSchema:
    """The schema, or null."""
    kind = schema.get("type")
    if isinstance(kind, str) and "enum" not in schema:
        return {**schema, "type": [kind, "null"]}
    return {"anyOf": [schema, {"type": "null"}]}


def given(*keys: str) -> JsonSchema:
    """An object in which each of the keys has a value that is not null."""
    return {"required": [*keys], "properties": {key: {"not": {"type": "null"}} for key in keys}}


def has(key: str, *values: Any) -> JsonSchema:
    """An object whose key has one of these values."""
    return {"required": [key], "properties": {key: {"enum": [*values]}}}


def when(condition: JsonSchema, then: JsonSchema) -> JsonSchema:
    """The schema `then` for an object of which the condition is true."""
    return {"if": condition, "then": then}


def text_form(pattern: str, *, without: str = "", expected: str = "") -> JsonSchema:
    """Text of a form; pattern as of re.fullmatch() with re.ASCII, `expected` in words for the reader."""
    ahead = f"(?!.*{re.escape(without)})" if without else ""
    form = {"pattern": rf"^{ahead}(?:{_ecma(pattern)})(?!\n)$"}  # Python's $ would allow a newline behind
    return {**form, "patternErrorMessage": f"expected {expected}"} if expected else form


def first_sentence(text: str | None) -> str:
    """The first paragraph of a docstring."""
    return " ".join((text or "").partition("\n\n")[0].split())


def _ecma(pattern: str) -> str:
    return "".join(_parts(re.sub(r"\(\?P<\w+>", "(?:", pattern)))


def _parts(pattern: str) -> Iterable[str]:
    in_class = False
    for part in re.findall(r"\\.|[^\\]", pattern, re.DOTALL):
        letters = _CLASSES.get(part)
        yield part if letters is None else letters if in_class else f"[{letters}]"
        in_class = part == "[" or (in_class and part != "]")
