"""ROS message and service classes by the names that architecture files use."""

import importlib
import re
from typing import Any


def message_class(name: str) -> Any:
    """The Python class of `package/msg/Name`; None when it is no installed ROS message."""
    found = _interface(name, "msg")
    return found if hasattr(found, "get_fields_and_field_types") else None


def service_class(name: str) -> Any:
    """The Python class of `package/srv/Name`; None when it is no installed ROS service."""
    found = _interface(name, "srv")
    return found if hasattr(found, "Request") and hasattr(found, "Response") else None


def _interface(name: str, kind: str) -> Any:
    match = re.fullmatch(rf"([a-z]\w*)/{kind}/([A-Z]\w*)", name, re.ASCII)
    if match is None:
        return None
    try:
        return getattr(importlib.import_module(f"{match[1]}.{kind}"), match[2], None)
    except ImportError:
        return None
