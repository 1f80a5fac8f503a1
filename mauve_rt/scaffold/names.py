"""Names of new packages and parts, checked before anything is written."""

import keyword
import re

from mauve_rt.errors import ParameterError

_PACKAGE = re.compile(r"[a-z](?:_?[a-z0-9])+")
_PART = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*")
_KEYWORDS_OF_CPP = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t
class co_await co_return co_yield compl concept const const_cast consteval constexpr constinit continue
decltype default delete do double dynamic_cast else enum explicit export extern false float for friend
goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private
protected public register reinterpret_cast requires return short signed sizeof static static_assert
static_cast struct switch template this thread_local throw true try typedef typeid typename union
unsigned using virtual void volatile wchar_t while xor xor_eq
"""
_CPP = frozenset(_KEYWORDS_OF_CPP.split())
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
    file = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", class_name).lower()
    for each in (class_name, file):
        _check_keyword(each, "name")
    return class_name, file


def _check_keyword(name: str, what: str) -> None:
    languages = [
        language
        for language, is_one in (("C++", name in _CPP), ("Python", keyword.iskeyword(name)))
        if is_one
    ]
    if languages:
        raise ParameterError(
            f"{what}: '{name}' is a keyword of {' and '.join(languages)}. Choose another name."
        )
