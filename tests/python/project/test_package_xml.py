"""package.xml, requirements/ and versions say exactly what the sources need."""

import ast
import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import mauve_rt
from mauve_rt import _kernel

ROOT = Path(__file__).resolve().parents[3]
PRODUCT = ("mauve_rt", "mauve_examples", "mauve_msgs", "cmake")
OF_TESTS = ("tests", "mauve_examples/tests", "benchmarks")
ON_THE_PATH_OF_TESTS = ("tests", "tests/plugins", "benchmarks", "scripts")
OWN = {"mauve_rt", "mauve_examples", "mauve_msgs"}
# Of modules that are no ROS packages: rosdep's key (rosdep/python.yaml) and the name in requirements/.
MODULES = {
    "argcomplete": ("python3-argcomplete", "argcomplete"),
    "catkin_pkg": ("python3-catkin-pkg-modules", "catkin-pkg"),
    "elftools": ("", "pyelftools"),
    "hypothesis": ("python3-hypothesis", "hypothesis"),
    "matplotlib": ("python3-matplotlib", "matplotlib"),
    "jinja2": ("python3-jinja2", "jinja2"),
    "jsonschema": ("python3-jsonschema", "jsonschema"),
    "lz4": ("", "mcap"),  # comes with it
    "markdown_it": ("", "rich"),  # comes with it
    "mcap": ("", "mcap"),
    "networkx": ("python3-networkx", "networkx"),
    "numpy": ("python3-numpy", "numpy"),
    "pandas": ("python3-pandas", "pandas"),
    "perfetto": ("", "perfetto"),
    "pytest": ("python3-pytest", "pytest"),
    "response_time_analysis": ("", "response-time-analysis"),  # likewise: the tests' only
    "rich": ("python3-rich", "rich"),
    "rosbags": ("", "rosbags"),
    "ruamel": ("python3-ruamel.yaml", "ruamel.yaml"),
    "scipy": ("python3-scipy", "scipy"),
    "yaml": ("python3-yaml", "PyYAML"),
    "zstandard": ("", "mcap"),  # comes with it
}
# rosdep has no key; where they are used they say how to get them
OPTIONAL = {"elftools", "lz4", "mcap", "perfetto", "rosbags", "zstandard"}
# Of CMake's packages that rosdep calls otherwise: its keys (rosdep/base.yaml); none if nothing is installed.
CMAKE_PACKAGES: dict[str, set[str]] = {
    "GTest": {"gtest", "google-mock"},
    "PNG": {"libpng-dev"},
    "Python3": {"python3-dev"},
    "Threads": set(),
    "mauve_rt": set(),
    "pybind11": {"pybind11-dev"},
}
PROGRAMS = {"dot": "graphviz"}  # that sources run, and rosdep's keys
TOOLS = {"cmake", "ament_cmake", "rosidl_default_generators"}
GENERATED = {"rosidl_default_runtime"}  # what the generated code of mauve_msgs needs to run
PLUGINS = {"python3-pytest-timeout"}  # configured in pyproject.toml, imported by nobody


def _depends(package: Path, *kinds: str) -> set[str]:
    root = ET.parse(package / "package.xml").getroot()  # noqa: S314 - our own file
    return {(element.text or "").strip() for kind in kinds for element in root.iter(kind)}


def _version(package: Path) -> str:
    return (ET.parse(package / "package.xml").findtext("version") or "").strip()  # noqa: S314 - likewise


def _files(folders: tuple[str, ...], *patterns: str) -> Iterator[Path]:
    """What is in these folders; of a part of the product without its tests."""
    for folder in folders:
        for pattern in patterns:
            for file in (ROOT / folder).rglob(pattern):
                if folder not in PRODUCT or "tests" not in file.relative_to(ROOT).parts:
                    yield file


def _imports(file: Path) -> set[str]:
    """Modules outside the standard library and the project that are imported when the code runs."""
    found: set[str] = set()
    pending: list[ast.AST] = [ast.parse(file.read_text(encoding="utf-8"))]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            pending += node.orelse
            continue
        if isinstance(node, ast.Import):
            found |= {name.name.partition(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add((node.module or "").partition(".")[0])
        pending += ast.iter_child_nodes(node)
    is_test = any(file.is_relative_to(ROOT / folder) for folder in OF_TESTS)
    folders = (str(file.parent), *ON_THE_PATH_OF_TESTS) if is_test else ()
    beside = {path.stem for path in _files(folders, "*.py")}
    return found - set(sys.stdlib_module_names) - OWN - beside


def _modules(folders: tuple[str, ...]) -> set[str]:
    files = [file for file in _files(folders, "*.py") if "downstream" not in file.parts]
    return {module for file in files for module in _imports(file)}


def _keys(modules: set[str]) -> set[str]:
    return {MODULES[module][0] if module in MODULES else module for module in modules} - {""}


def _types_by_name() -> set[str]:
    """Packages of message types that sources name as `package/msg/Type`, C++ comments aside."""
    files = _files(PRODUCT, "*.py", "*.yaml", "*.hpp", "*.cpp", "CMakeLists.txt")
    text = "\n".join(re.sub("//.*", "", file.read_text(encoding="utf-8")) for file in files)
    return set(re.findall(r"\b([a-z]\w*)/(?:msg|srv|action)/[A-Z]", text)) - OWN - {"package"}


def _ros2_commands() -> set[str]:
    """Packages of the verbs that sources run as `ros2 VERB ...`."""
    files = _files(PRODUCT, "*.py")
    return {
        f"ros2{verb}"
        for file in files
        for verb in re.findall(r'\["ros2", "(\w+)"', file.read_text(encoding="utf-8"))
    }


def _programs() -> set[str]:
    """Packages of other programs that sources run."""
    text = "\n".join(file.read_text(encoding="utf-8") for file in _files(PRODUCT, "*.py"))
    return {package for program, package in PROGRAMS.items() if f'_run("{program}", ' in text}


def _found_by_cmake(folders: tuple[str, ...]) -> set[str]:
    keys: set[str] = set()
    for file in _files(folders, "CMakeLists.txt", "*.cmake"):
        if "downstream" in file.parts:
            continue
        for package in re.findall(r"find_package\(([\w-]+)", file.read_text(encoding="utf-8")):
            keys |= CMAKE_PACKAGES.get(package, {package})
    return keys


def test_what_runs_is_listed_exactly() -> None:
    needed = _keys(_modules(PRODUCT)) | _types_by_name() | _ros2_commands() | _programs() | GENERATED
    libraries = _found_by_cmake(PRODUCT)
    listed = _depends(ROOT, "depend", "exec_depend")
    assert needed - listed == set(), "add to package.xml"
    assert listed - needed - libraries == set(), "nothing needs these of package.xml"


def test_the_door_opens_with_rosdep_and_apt_alone() -> None:
    """Ubuntu 24.04 refuses pip outside of an environment (PEP 668): rosdep brings no such key there."""
    kinds = ("depend", "build_depend", "build_export_depend", "buildtool_depend", "exec_depend")
    packages = (ROOT, ROOT / "mauve_msgs")
    keys = {key for package in packages for key in _depends(package, *kinds)}
    assert {key for key in keys if key.endswith("-pip")} == set()
    modules = _modules(PRODUCT) & MODULES.keys()
    others = {module for module in modules if not MODULES[module][0].startswith("python3-")}
    assert others - OPTIONAL == set(), "no package of Debian's and Ubuntu's"


def test_what_builds_is_listed_exactly() -> None:
    of_tests = _found_by_cmake(OF_TESTS)
    needed = (_found_by_cmake(PRODUCT) - of_tests) | TOOLS
    listed = _depends(ROOT, "depend", "build_depend", "buildtool_depend")
    assert needed - listed == set(), "add to package.xml"
    only_to_build = _depends(ROOT, "build_depend", "buildtool_depend")
    assert only_to_build - needed == set(), "nothing needs these of package.xml"


def test_what_tests_is_listed_exactly() -> None:
    modules = _keys(_modules(OF_TESTS)) | _found_by_cmake(OF_TESTS) | PLUGINS
    others = _depends(ROOT, "depend", "exec_depend")
    assert _depends(ROOT, "test_depend") == modules - others


def test_mauve_msgs_is_part_of_mauve_rt() -> None:
    kinds = ("depend", "build_depend", "buildtool_depend", "exec_depend")
    assert _depends(ROOT / "mauve_msgs", *kinds) <= _depends(ROOT, *kinds)
    assert _depends(ROOT / "mauve_msgs", "depend", "buildtool_depend") == _found_by_cmake(("mauve_msgs",))


def test_requirements_name_the_same_modules() -> None:
    lines = [
        line
        for name in ("run", "ros-wheels")
        for line in (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    ]
    listed = {match[1] for line in lines if (match := re.match(r"([\w.-]+)[\w\[\]]*==", line))}
    needed = {MODULES[module][1] for module in _modules(PRODUCT) if module in MODULES}
    assert {name for name in listed if not name.startswith("ros-")} == needed


def test_there_is_one_version() -> None:
    assert mauve_rt.__version__ == _kernel.__version__ == _version(ROOT) == _version(ROOT / "mauve_msgs")
    assert version("mauve_rt") == _version(ROOT), "the metadata of the installation"
    assert re.fullmatch(r"\d+\.\d+\.\d+", mauve_rt.__version__)
