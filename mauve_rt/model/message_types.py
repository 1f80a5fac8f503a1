"""ROS message classes by the names that architecture files use."""

import importlib
import re
from typing import Any


def message_class(name: str) -> Any:
    """The Python class of `package/msg/Name`; None when it is no installed ROS message."""
    match = re.fullmatch(r"([a-z]\w*)/msg/([A-Z]\w*)", name, re.ASCII)
    if match is None:
        return None
    try:
        found = getattr(importlib.import_module(f"{match[1]}.msg"), match[2], None)
    except ImportError:
        return None
    return found if hasattr(found, "get_fields_and_field_types") else None
