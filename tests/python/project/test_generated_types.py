"""mauve_generate_types(): C++ structs for installed interfaces, from a package that finds mauve_rt."""

import ctypes
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from compiled_plugins import INSTALLED, compile_source, link
from rosidl_adapter import convert_to_idl

CMAKE_FILES = INSTALLED / "share" / "mauve_rt" / "cmake"
ROS = [path for path in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep) if path]
ERRORS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")


def run(*words: str | Path) -> str:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


INTERFACES = {
    "msg/Odd.msg": """\
# One of each kind. \\\\\\\\
byte BYTE=1
char CHAR=2
int64 LEAST=-9223372036854775808
uint64 MOST=18446744073709551615
float32 RATIO=0.1
string TEXT="a \\"quoted\\" ö?"
wstring WIDE="ö"
float64 speed 1.5  # of the wheel [m/s]
bool class true
byte octet 7
char letter 97
int8 small -128
int64 least -9223372036854775808
uint64 most 18446744073709551615
float32 ratio 0.1
string<=5 name "abc"
string[2] names ["a", "b"]
wstring wide "ö€"
wstring[] wides
int32[3] three [1, 2, 3]
int16[<=4] few [5, 6]
float64[] many
Part part
Part[2] pair
Part[<=2] parts
Part[] rest
std_msgs/Header header
""",
    "msg/Large.msg": "".join(f"int32 field_{i}\n" for i in range(150)),
    "msg/Part.msg": "float32[] values\n",
    "msg/Nothing.msg": "int32 ONE=1\n",
    "srv/Ask.srv": "Part part\n---\nint32 number -1\n",
    "action/Go.action": "float64 goal\n---\nint32 result\n---\nPart part\n",
    "action/Turn.action": "float64 angle\n---\nbool reached\n---\nfloat64 left\n",
}
PROGRAM = r"""
#include <mauve_rt/mauve_rt.hpp>
#include <mauve_types/odd_interfaces/action/go.hpp>
#include <mauve_types/odd_interfaces/action/turn.hpp>
#include <mauve_types/odd_interfaces/msg/large.hpp>
#include <mauve_types/odd_interfaces/msg/nothing.hpp>
#include <mauve_types/odd_interfaces/msg/odd.hpp>
#include <mauve_types/odd_interfaces/srv/ask.hpp>

using mauve::msg::odd_interfaces::Ask;
using mauve::msg::odd_interfaces::Go;
using mauve::msg::odd_interfaces::Large;
using mauve::msg::odd_interfaces::Nothing;
using mauve::msg::odd_interfaces::Odd;
using mauve::msg::odd_interfaces::Turn;

static_assert(Odd::BYTE == 1 && Odd::CHAR == 2 && Odd::RATIO == 0.1F && Nothing::ONE == 1);
static_assert(Odd::LEAST == INT64_MIN && Odd::MOST == UINT64_MAX);
static_assert(Odd::TEXT == "a \"quoted\" \u00f6?" && Odd::WIDE == u"\u00f6");
static_assert(std::tuple_size_v<decltype(mauve::TypeTraits<Large>::fields())> == 150);
static_assert(!mauve::DescribedCall<Ask>, "a request with a sequence cannot be copied");
static_assert(mauve::DescribedCall<Go::SendGoal> && mauve::DescribedCall<Go::GetResult>);
static_assert(mauve::Described<Go::Goal> && mauve::Described<Go::Result> && mauve::Described<Go::Feedback> &&
              mauve::Described<Go::FeedbackMessage>);
static_assert(mauve::DescribedAction<Turn>);
static_assert(mauve::ActionTraits<Turn>::name == "odd_interfaces/action/Turn");
static_assert(!mauve::DescribedAction<Go>, "feedback with a sequence cannot be copied");

#define EXPECT(...) \
  if (!(__VA_ARGS__)) return #__VA_ARGS__

extern "C" const char* failure() {
  const Odd odd;
  EXPECT(odd.speed == 1.5 && odd.class_ && odd.octet == 7 && odd.letter == 97 && odd.small == -128);
  EXPECT(odd.least == INT64_MIN && odd.most == UINT64_MAX && odd.ratio == 0.1F);
  EXPECT(odd.name == "abc" && odd.name.capacity() == 5 && odd.names[0] == "a" && odd.names[1] == "b");
  EXPECT(odd.wide == u"\u00f6\u20ac" && odd.wide.capacity() == 255 && odd.wides.empty());
  EXPECT(odd.three == std::array<std::int32_t, 3>{1, 2, 3});
  EXPECT(odd.few.size() == 2 && odd.few[1] == 6 && odd.few.capacity() == 4);
  EXPECT(odd.many.empty() && odd.parts.empty() && odd.parts.capacity() == 2 && odd.rest.empty());
  EXPECT(Ask::Response{}.number == -1);
  EXPECT(mauve::CallTraits<Ask>::name == "odd_interfaces/srv/Ask");
  EXPECT(mauve::TypeTraits<Go::SendGoal::Request>::name == "odd_interfaces/action/Go_SendGoal_Request");
  const auto paths = mauve::sequence_paths(mauve::message_shape<Odd>());
  EXPECT(paths == std::vector<std::string>{"wides", "many", "part.values", "pair.values", "parts.values",
                                           "rest", "rest.values"});
  EXPECT(mauve::message_shape<Odd>().fields[11].type == "wstring");
  return nullptr;
}
"""


FAST_CDR = r"""
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <mauve_rt/mauve_rt.hpp>
#include <mauve_types/odd_interfaces/msg/odd.hpp>
#include <rosidl_typesupport_fastrtps_cpp/serialization_helpers.hpp>

/// Texts that rosidl's type support writes, through the struct's member and back to rosidl's type support.
extern "C" const char* failure() {
  using namespace eprosima::fastcdr;
  for (const std::u16string text : {u"", u"a", u"\u00f6\u20ac", u"\U0001f600"}) {
    std::array<char, 256> sent{};
    FastBuffer buffer(sent.data(), sent.size());
    Cdr writer(buffer, Cdr::DEFAULT_ENDIAN, CdrVersion::DDS_CDR);
    writer.serialize_encapsulation();
    rosidl_typesupport_fastrtps_cpp::cdr_serialize(writer, text);
    const std::span message = std::as_bytes(std::span(sent)).first(writer.get_serialized_data_length());
    decltype(mauve::msg::odd_interfaces::Odd::wide) wide;
    if (!mauve::CdrReader(message).get(wide) || wide != text.c_str()) return "read";
    std::vector<std::byte> written;
    mauve::CdrWriter(written).put(wide);
    if (!std::ranges::equal(written, message)) return "bytes";
    FastBuffer back_buffer(reinterpret_cast<char*>(written.data()), written.size());
    Cdr reader(back_buffer, Cdr::DEFAULT_ENDIAN, CdrVersion::DDS_CDR);
    reader.read_encapsulation();
    std::u16string back;
    if (!rosidl_typesupport_fastrtps_cpp::cdr_deserialize(reader, back) || back != text) return "written";
  }
  return nullptr;
}
"""


def install(prefix: Path, interfaces: dict[str, str], package: str = "odd_interfaces") -> None:
    """Install interfaces as rosidl does: each as .idl, and the package in the index."""
    share = prefix / "share" / package
    for name, text in interfaces.items():
        path = share / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        convert_to_idl(share, package, Path(name), share)
    index = prefix / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"
    index.mkdir(parents=True, exist_ok=True)
    (index / package).touch()


def generate(prefix: Path, *interfaces: str) -> subprocess.CompletedProcess[str]:
    """Write headers to prefix/types/include."""
    words = ["--target", "odd", "--output", prefix / "types" / "include", "--prefixes", prefix, *ROS]
    program = [sys.executable, CMAKE_FILES / "mauve_generate_types.py"]
    return subprocess.run(
        [*program, *words, "--interfaces", *interfaces], capture_output=True, text=True, check=False
    )


def header(prefix: Path, name: str) -> Path:
    return prefix / "types" / "include" / "mauve_types" / "odd_interfaces" / name


def failure(prefix: Path, program: str, *flags: str, libraries: Sequence[str] = ()) -> bytes | None:
    """Compile a program with the headers and call its function failure()."""
    source = prefix / "program.cpp"
    source.write_text(program, encoding="utf-8")
    compile_source(source, prefix / "program.o", f"-I{prefix}/types/include", *flags)
    link([prefix / "program.o"], prefix / "program.so", *libraries)
    function = ctypes.CDLL(str(prefix / "program.so")).failure
    function.restype = ctypes.c_char_p
    found: bytes | None = function()
    return found


def test_fields_defaults_constants_and_comments_are_those_of_the_interface(tmp_path: Path) -> None:
    install(tmp_path, INTERFACES)
    done = generate(tmp_path, "odd_interfaces")
    assert done.returncode == 0, done.stderr
    lines = header(tmp_path, "msg/odd.hpp").read_text("utf-8").splitlines()
    assert lines[lines.index("struct Odd {") - 1] == "/// One of each kind. \\."
    assert lines[lines.index("  double speed{1.5};") - 1] == "  /// of the wheel [m/s]"
    assert failure(tmp_path, PROGRAM, *ERRORS) is None


def test_wide_text_is_read_and_written_as_rosidl_does(tmp_path: Path) -> None:
    install(tmp_path, {name: INTERFACES[name] for name in ("msg/Odd.msg", "msg/Part.msg")})
    assert generate(tmp_path, "odd_interfaces").returncode == 0
    parts = ("fastcdr", "rosidl_typesupport_fastrtps_cpp", "rosidl_typesupport_interface", "rosidl_runtime_c")
    includes = [
        f"-I{prefix}/include{part}" for prefix in ROS for part in ("", *(f"/{part}" for part in parts))
    ]
    libraries = [f"-L{prefix}/lib" for prefix in ROS]
    assert failure(tmp_path, FAST_CDR, *includes, libraries=(*libraries, "-lfastcdr")) is None


def test_only_what_changes_is_written(tmp_path: Path) -> None:
    install(tmp_path, INTERFACES)
    read = generate(tmp_path, "odd_interfaces/msg/Odd").stdout.splitlines()
    assert str(tmp_path / "share/odd_interfaces/msg/Part.idl") in read
    odd, part = header(tmp_path, "msg/odd.hpp"), header(tmp_path, "msg/part.hpp")
    before = odd.stat().st_mtime_ns, part.stat().st_mtime_ns
    install(tmp_path, {"msg/Part.msg": "float32[] values\nfloat32 more\n"})
    assert generate(tmp_path, "odd_interfaces/msg/Odd").stdout.splitlines() == read
    assert odd.stat().st_mtime_ns == before[0]
    assert part.stat().st_mtime_ns != before[1]
    assert "float more" in part.read_text("utf-8")


def test_all_of_a_package_has_what_is_added_to_it(tmp_path: Path) -> None:
    install(tmp_path, {"msg/Part.msg": INTERFACES["msg/Part.msg"]})
    assert generate(tmp_path, "odd_interfaces").returncode == 0
    install(tmp_path, {"msg/Nothing.msg": INTERFACES["msg/Nothing.msg"]})
    assert generate(tmp_path, "odd_interfaces").returncode == 0
    assert header(tmp_path, "msg/nothing.hpp").is_file()


REFUSED = {
    "package": (
        {},
        "odd_interface/msg/Part",
        "no installed package odd_interface with interfaces (there is odd_interfaces",
    ),
    "message": (
        {},
        "odd_interfaces/msg/Prat",
        "found odd_interfaces/msg/Prat (there is odd_interfaces/msg/Part",
    ),
    "kind": ({}, "odd_interfaces/Part", "found odd_interfaces/Part (there is odd_interfaces/msg/Part"),
    "default of a sequence": (
        {"msg/Bad.msg": "int32[] numbers [1, 2]\n"},
        "odd_interfaces/msg/Bad",
        "odd_interfaces/msg/Bad, field 'numbers': default (1, 2), but a sequence without a bound comes empty",
    ),
    "long text": (
        {"msg/Bad.msg": f'string text "{"m" * 256}"\n'},
        "odd_interfaces/msg/Bad",
        "field 'text': expected at most 255 characters, found a value of 256",
    ),
    "many fields": (
        {"msg/Bad.msg": "".join(f"int32 field_{i}\n" for i in range(151))},
        "odd_interfaces/msg/Bad",
        "odd_interfaces/msg/Bad: expected at most 150 fields, found 151. Divide it into messages.",
    ),
    "nested": (
        {"msg/Bad.msg": "gone_msgs/Gone gone\n"},
        "odd_interfaces/msg/Bad",
        "no installed package gone_msgs",
    ),
    "one name": (
        {"msg/Ask.msg": "int32 number\n"},
        "odd_interfaces",
        "would both be mauve::msg::odd_interfaces::Ask. Generate them into two libraries.",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_call_that_cannot_be_is_refused_in_a_sentence(case: str, tmp_path: Path) -> None:
    added, name, message = REFUSED[case]
    install(tmp_path, INTERFACES | added)
    done = generate(tmp_path, name)
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert message in line


def test_a_type_without_a_struct_is_refused(tmp_path: Path) -> None:
    install(tmp_path, INTERFACES)
    idl = tmp_path / "share/odd_interfaces/msg/Long.idl"
    idl.write_text(
        "module odd_interfaces { module msg { struct Long { long double value; }; }; };\n", encoding="utf-8"
    )
    done = generate(tmp_path, "odd_interfaces/msg/Long")
    assert done.stderr.startswith(
        "odd_interfaces/msg/Long, field 'value': type long double has no C++ struct. Use"
    )


@pytest.mark.timeout(300)
def test_interfaces_of_the_same_package_are_found(tmp_path: Path) -> None:
    install(tmp_path, {"msg/Part.msg": INTERFACES["msg/Part.msg"]})
    package = tmp_path / "share" / "odd_interfaces"
    (package / "msg" / "Part.idl").unlink()
    (package / "package.xml").write_text(
        """\
<?xml version="1.0"?>
<package format="3">
  <name>odd_interfaces</name>
  <version>0.1.0</version>
  <description>A message and the structs of it</description>
  <maintainer email="you@example.invalid">You</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>mauve_rt</depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
""",
        encoding="utf-8",
    )
    (package / "CMakeLists.txt").write_text(
        """\
cmake_minimum_required(VERSION 3.22)
project(odd_interfaces LANGUAGES C CXX)
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(mauve_rt REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME} msg/Part.msg)
mauve_generate_types(odd_types odd_interfaces/msg/Part)
ament_package()
""",
        encoding="utf-8",
    )
    prefixes = ";".join([str(INSTALLED), *ROS])
    options = [f"-DCMAKE_PREFIX_PATH={prefixes}", f"-DPython3_EXECUTABLE={sys.executable}"]
    run("cmake", "-S", package, "-B", tmp_path / "build", *options)
    written = tmp_path / "build/mauve_types/include/mauve_types/odd_interfaces/msg/part.hpp"
    assert "::mauve::Sequence<float> values;" in written.read_text("utf-8")


def test_cmake_names_the_line_of_a_wrong_call(tmp_path: Path) -> None:
    (tmp_path / "CMakeLists.txt").write_text(
        f"""\
cmake_minimum_required(VERSION 3.22)
project(downstream LANGUAGES NONE)
include("{CMAKE_FILES}/mauve_generate_types.cmake")
mauve_generate_types(my_types sensor_msgs/msg/Imuu)
""",
        encoding="utf-8",
    )
    words = ["-S", tmp_path, "-B", tmp_path / "build", f"-DPython3_EXECUTABLE={sys.executable}"]
    done = subprocess.run(["cmake", *words], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    said = " ".join(done.stderr.split())
    assert "mauve_generate_types(my_types): expected an interface of sensor_msgs such as" in said
    assert "found sensor_msgs/msg/Imuu (there is sensor_msgs/msg/Imu" in said
    assert "CMakeLists.txt:4 (mauve_generate_types)" in said
