"""Names of new packages and parts, checked before anything is written."""

import re

from mauve_rt.errors import ParameterError
from mauve_rt.modelling.cpp import snake
from mauve_rt.modelling.keywords import languages_of_keyword

_PACKAGE = re.compile(r"[a-z](?:_?[a-z0-9])+")
_PART = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*")
# A package is a C++ namespace, a Python module and a CMake project: names that one of these has already.
_TAKEN = frozenset({"all", "clean", "help", "install", "mauve", "package", "std", "test"})


def check_package(name: str) -> None:
    """Refuse a name that ROS, CMake, C++ or Python does not accept.

    Raises:
        ParameterError: with the reason and a name that can be used.
    """
    if not _PACKAGE.fullmatch(name):
        words = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+", name)
        better = "_".join(words).lower()
        remedy = better if _PACKAGE.fullmatch(better) else "my_robot"
        raise ParameterError(
            f"package name: expected lower-case letters, digits and single underscores after a first letter, "
            f"found '{name}'. Choose a name such as {remedy}."
        )
    if name in _TAKEN:
        raise ParameterError(
            f"package name: '{name}' has a meaning of its own in CMake or C++. Choose another name."
        )
    _check_keyword(name, "package name")


def part_names(name: str) -> tuple[str, str]:
    """The name of a part's class, and the one of its files: LiftArm and lift_arm.

    Raises:
        ParameterError: the name is no identifier of C++ and Python.
    """
    if not _PART.fullmatch(name):
        raise ParameterError(
            f"name: expected letters, digits and single underscores after a first letter, found '{name}'. "
            "Choose a name such as LiftArm."
        )
    class_name = "".join(word[0].upper() + word[1:] for word in name.split("_"))
    file = snake(class_name)
    for each in (class_name, file):
        _check_keyword(each, "name")
    return class_name, file


def _check_keyword(name: str, what: str) -> None:
    languages = languages_of_keyword(name)
    if languages:
        raise ParameterError(
            f"{what}: '{name}' is a keyword of {' and '.join(languages)}. Choose another name."
        )
