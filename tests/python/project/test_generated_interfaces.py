"""mauve_generate_interfaces(): what it refuses, and when it compiles.

tests/ros/test_downstream.py uses its messages.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from compiled_plugins import INSTALLED

pytestmark = pytest.mark.timeout(300)  # it compiles
PREFIXES = ";".join([str(INSTALLED), *filter(None, os.environ["AMENT_PREFIX_PATH"].split(os.pathsep))])
HEADER = """\
#include <mauve_rt/data/cdr.hpp>
namespace odd {
struct Inner { double value{}; };
struct Good { double value_{}; Inner inner; };
struct Plain { double value{}; };
struct Holder { Plain plain; };
struct Other { double value{}; };
struct Lower { double value{}; };
struct Capital { double Value{}; };
struct Twice { double value__x{}; };
struct Wide { long double value{}; };
struct Row { std::array<mauve::BoundedVector<double, 2>, 3> rows; };
struct Table { std::array<Row, 2> rows; };
struct Copy { double copied{}; };
struct Foreign { double value{}; };
struct Gone { Foreign foreign; };
}  // namespace odd
MAUVE_TYPE(odd::Inner, "odd/msg/Inner", value)
MAUVE_TYPE(odd::Good, "odd/msg/Good", value_, inner)
MAUVE_TYPE(odd::Other, "other/msg/Other", value)
MAUVE_TYPE(odd::Lower, "odd/msg/lower", value)
MAUVE_TYPE(odd::Capital, "odd/msg/Capital", Value)
MAUVE_TYPE(odd::Twice, "odd/msg/Twice", value__x)
MAUVE_TYPE(odd::Wide, "odd/msg/Wide", value)
MAUVE_TYPE(odd::Row, "odd/msg/Row", rows)
MAUVE_TYPE(odd::Table, "odd/msg/Table", rows)
MAUVE_TYPE(odd::Copy, "odd/msg/Good", copied)
MAUVE_TYPE(odd::Foreign, "geometry_msgs/msg/Foreign", value)
MAUVE_TYPE(odd::Gone, "odd/msg/Gone", foreign)
"""
HOLDER = 'MAUVE_TYPE(odd::Holder, "odd/msg/Holder", plain)\n'
WRITTEN = "float64 value\nodd/Inner inner\n"
Configure = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package whose compilers CMake looks for once."""
    folder = tmp_path_factory.mktemp("odd")
    (folder / "include").mkdir()
    (folder / "package.xml").write_text(
        """\
<?xml version="1.0"?>
<package format="3">
  <name>odd</name>
  <version>0.1.0</version>
  <description>Structs that are messages</description>
  <maintainer email="you@example.invalid">You</maintainer>
  <license>Apache-2.0</license>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
""",
        encoding="utf-8",
    )
    return folder


@pytest.fixture
def configure(package: Path) -> Configure:
    """Configure with a call of mauve_generate_interfaces()."""

    def configure(
        call: str, *, header: str = HEADER, languages: str = "C CXX", build: str = "build"
    ) -> subprocess.CompletedProcess[str]:
        for name, text in {
            "include/odd.hpp": header,
            "CMakeLists.txt": f"""\
cmake_minimum_required(VERSION 3.22)
project(odd LANGUAGES {languages})
find_package(ament_cmake REQUIRED)
find_package(mauve_rt REQUIRED)
mauve_generate_interfaces({call})
""",
        }.items():
            if not (package / name).is_file() or (package / name).read_text("utf-8") != text:
                (package / name).write_text(text, encoding="utf-8")
        options = ["-G", "Ninja", f"-DCMAKE_PREFIX_PATH={PREFIXES}", f"-DPython3_EXECUTABLE={sys.executable}"]
        words = ["cmake", "-S", package, "-B", package / build, *options]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    return configure


REFUSED = {
    "no MAUVE_TYPE": (
        "HEADERS include/odd.hpp STRUCTS odd::Plain",
        'expected MAUVE_TYPE, found none. Add MAUVE_TYPE(odd::Plain, "odd/msg/NAME", FIELDS...) to',
    ),
    "other package": (
        "HEADERS include/odd.hpp STRUCTS odd::Other",
        "struct odd::Other: expected a message of this package, odd/msg/NAME, found other/msg/Other. Change",
    ),
    "message's name": (
        "HEADERS include/odd.hpp STRUCTS odd::Lower",
        "struct odd::Lower: expected the name of a message such as odd/msg/LegState, found odd/msg/lower.",
    ),
    "capital": (
        "HEADERS include/odd.hpp STRUCTS odd::Capital",
        "struct odd::Capital, field 'Value' of odd/msg/Capital: expected lower-case letters, digits and",
    ),
    "underscores": (
        "HEADERS include/odd.hpp STRUCTS odd::Twice",
        "field 'value__x' of odd/msg/Twice: expected lower-case letters, digits and single underscores",
    ),
    "long double": (
        "HEADERS include/odd.hpp STRUCTS odd::Wide",
        "field 'value' of odd/msg/Wide: long double has no type in ROS messages. Use double.",
    ),
    "list of lists": (
        "HEADERS include/odd.hpp STRUCTS odd::Table",
        "struct odd::Table: a list of lists has no type in ROS messages. Put the inner list into a struct.",
    ),
    "one name": (
        "HEADERS include/odd.hpp STRUCTS odd::Good odd::Copy",
        "struct odd::Copy: expected one struct of the name odd/msg/Good, found two with different fields.",
    ),
    "unknown message": (
        "HEADERS include/odd.hpp STRUCTS odd::Gone",
        "of geometry_msgs/msg/Foreign, found no installed package geometry_msgs with this message.",
    ),
    "unknown struct": (
        "HEADERS include/odd.hpp STRUCTS odd::Goood",
        "the headers do not compile with odd::Goood. Correct what the compiler names; each struct, also one",
    ),
    "file and struct": (
        "HEADERS include/odd.hpp STRUCTS odd::Good INTERFACES msg/Good.msg",
        "found msg/Good.msg as a file and as a struct. Remove one, of INTERFACES or of STRUCTS.",
    ),
    "no header": (
        "HEADERS include/even.hpp STRUCTS odd::Good",
        "include/even.hpp. Correct HEADERS.",
    ),
    "no struct": (
        "HEADERS include/odd.hpp",
        "expected HEADERS <file>... STRUCTS <struct>..., found 'HEADERS;include/odd.hpp'",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_struct_that_cannot_be_a_message_is_refused_in_a_sentence(case: str, configure: Configure) -> None:
    call, message = REFUSED[case]
    done = configure(call)
    assert done.returncode != 0
    said = " ".join(done.stderr.split())
    assert f"mauve_generate_interfaces: {'there is no header' if case == 'no header' else ''}" in said
    assert message in said
    assert "CMakeLists.txt:5 (mauve_generate_interfaces)" in said


def test_a_struct_within_without_a_name_is_named_by_the_compiler(configure: Configure) -> None:
    done = configure("HEADERS include/odd.hpp STRUCTS odd::Holder", header=HEADER + HOLDER)
    said = " ".join(done.stderr.split())
    assert "each struct, also one within another, needs MAUVE_TYPE." in said
    assert "odd::Plain" in said


def test_the_language_of_rosidl_is_asked_for(configure: Configure) -> None:
    done = configure("HEADERS include/odd.hpp STRUCTS odd::Good", languages="CXX", build="build_cxx")
    said = " ".join(done.stderr.split())
    assert "expected the languages C and CXX, found no C" in said
    assert "Write project(odd LANGUAGES C CXX)." in said


def test_a_header_that_changes_is_compiled_by_the_next_build(configure: Configure, package: Path) -> None:
    inner, folder = package / "include" / "inner.hpp", package / "build"
    text = "struct Inner { double value{}; };\n"
    inner.write_text(f"#pragma once\nnamespace odd {{ {text}}}\n", encoding="utf-8")
    header = HEADER.replace("namespace odd {\n" + text, '#include "inner.hpp"\nnamespace odd {\n')
    call = "HEADERS include/odd.hpp STRUCTS odd::Good"
    first = configure(call, header=header)
    assert "Making messages of odd::Good" in first.stdout
    messages = folder / "mauve_interfaces" / "msg"
    assert (messages / "Good.msg").read_text("utf-8") == WRITTEN
    assert (messages / "Inner.msg").read_text("utf-8") == "float64 value\n"  # a struct within comes along
    before = (messages / "Good.msg").stat().st_mtime_ns
    assert "Making messages" not in configure(call, header=header).stdout
    inner.write_text(inner.read_text("utf-8").replace("double", "float"), encoding="utf-8")
    again = subprocess.run(
        ["cmake", "--build", folder, "--target", "build.ninja"], capture_output=True, text=True, check=True
    )
    assert "Making messages of odd::Good" in again.stdout
    assert (messages / "Inner.msg").read_text("utf-8") == "float32 value\n"
    assert (messages / "Good.msg").stat().st_mtime_ns == before  # as it was
