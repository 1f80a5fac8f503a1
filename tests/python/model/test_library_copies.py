"""Copies of rebuilt libraries run in parallel with the old ones; each scenario in a process of its own."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.errors import PluginError
from mauve_rt.model import elf_library
from mauve_rt.model.elf_library import ElfLibrary
from mauve_rt.model.library_copies import copy_libraries, loaded_dependencies
from mauve_rt.model.workspace_files import may_be_rebuilt

pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")

HEADER = """\
inline int variable = V;
inline int& local() { static int value = V * 10; return value; }
template <class T> struct Box { static int value; };
template <class T> int Box<T>::value = V * 100;
int helper_version();
void helper_set(int value);
"""
HELPER = """\
#include "helper.hpp"
int helper_version() { return V; }
void helper_set(int value) { variable = local() = Box<int>::value = value; }
"""
PLUGIN = """\
#include "helper.hpp"
extern "C" int objects(int index) { return index == 0 ? variable : index == 1 ? local() : Box<int>::value; }
extern "C" int version() { return helper_version(); }
extern "C" void set(int value) { helper_set(value); }
"""
SCENARIO = """\
import ctypes, json, os, shutil, subprocess, sys
from pathlib import Path
from mauve_rt.model.library_copies import copy_libraries, loaded_dependencies
folder = Path(sys.argv[1])
plugin, helper = folder / "libplugin.so", folder / "libhelper.so"
def load(*paths):
    return [ctypes.CDLL(str(path), mode=os.RTLD_NOW) for path in paths][-1]
def state(library):
    return [*(library.objects(index) for index in range(3)), library.version()]
def build(version):
    subprocess.run([sys.executable, sys.argv[2], folder, str(version)], check=True)
def copies(*libraries, generation):
    (folder / str(generation)).mkdir()
    return copy_libraries(libraries, folder=folder / str(generation), generation=generation)
def answer(*values):
    print(json.dumps(values))
"""
BUILDER = """\
import subprocess, sys
folder, version = sys.argv[1:]
for name, more in (("helper", []), ("plugin", ["-L.", "-lhelper", "-Wl,-rpath,$ORIGIN"])):
    command = ["g++", "-shared", "-fPIC", f"-DV={version}", f"{name}.cpp", *more]
    subprocess.run([*command, f"-Wl,-soname,lib{name}.so", "-o", "new.so"], cwd=folder, check=True)
    subprocess.run(["mv", "new.so", f"lib{name}.so"], cwd=folder, check=True)
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    sources = {"helper.hpp": HEADER, "helper.cpp": HELPER, "plugin.cpp": PLUGIN, "build.py": BUILDER}
    for name, text in sources.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    subprocess.run([sys.executable, tmp_path / "build.py", tmp_path, "1"], check=True)
    return tmp_path


Run = Callable[[str], list[object]]


@pytest.fixture
def run(workspace: Path) -> Run:
    def run_scenario(text: str) -> list[object]:
        script = workspace / "scenario.py"
        script.write_text(SCENARIO + textwrap.dedent(text), encoding="utf-8")
        command = [sys.executable, script, workspace, workspace / "build.py"]
        outcome = subprocess.run(command, check=False, capture_output=True, text=True)
        assert outcome.returncode == 0, outcome.stderr
        answer: list[object] = json.loads(outcome.stdout)
        return answer

    return run_scenario


def _link(folder: Path, name: str, *arguments: str, text: str = "int of_it;") -> Path:
    source, library = folder / "source.cpp", folder / name
    source.write_text(text, encoding="utf-8")
    command = ["g++", "-shared", "-fPIC", "source.cpp", "-o", name, f"-L{folder}", "-Wl,--no-as-needed"]
    subprocess.run([*command, *arguments], cwd=folder, check=True)
    return library


def test_new_and_old_code_have_objects_of_their_own(run: Run) -> None:
    answer = run("""
        old = load(plugin)
        seen = [state(old)]
        for version in (2, 3):
            build(version)
            new = load(*copies(plugin, helper, generation=version))
            seen += [state(old), state(new)]
        answer(*seen)
    """)
    first, second, third = [1, 10, 100, 1], [2, 20, 200, 2], [3, 30, 300, 3]
    assert answer == [first, first, second, first, third]


def test_a_plain_copy_would_share_the_old_objects(run: Run) -> None:
    answer = run("""
        old = load(plugin)
        build(2)
        shutil.copy(plugin, folder / "libcopy.so")
        answer(state(load(folder / "libcopy.so")))
    """)
    assert answer == [[1, 10, 100, 1]]


def test_the_copies_of_one_generation_share_their_objects(run: Run) -> None:
    answer = run("""
        old = load(plugin)
        build(2)
        new = load(*copies(plugin, helper, generation=2))
        new.set(7)
        answer(state(old), state(new))
    """)
    assert answer == [[1, 10, 100, 1], [7, 7, 7, 2]]


def test_only_the_helper_was_rebuilt(run: Run) -> None:
    answer = run("""
        old = load(plugin)
        shutil.copy(plugin, folder / "kept.so")
        build(2)
        os.replace(folder / "kept.so", plugin)
        alone = load(*copies(plugin, generation=2))
        together = load(*copies(plugin, helper, generation=3))
        answer(old.version(), alone.version(), together.version())
    """)
    assert answer == [1, 1, 2]


def test_objects_of_a_library_that_is_not_copied_stay_one(run: Run) -> None:
    answer = run("""
        old = load(plugin)
        opened = copies(plugin, generation=2)
        new = load(*opened)
        new.set(7)
        answer(state(old), state(new), [path.name for path in opened])
    """)
    assert answer == [[7, 7, 7, 1], [7, 7, 7, 1], ["libhelper.so", "libplugin@2.so"]]


def test_dependencies_are_opened_first_and_by_full_path(run: Run) -> None:
    answer = run("""
        together = copies(plugin, helper, generation=2)
        alone = copies(plugin, generation=3)
        new = load(*alone)
        answer([str(path.relative_to(folder)) for path in together + alone], state(new))
    """)
    names = ["2/libhelper@2.so", "2/libplugin@2.so", "libhelper.so", "3/libplugin@3.so"]
    assert answer == [names, [1, 10, 100, 1]]


def test_a_copy_is_independent_of_the_original(run: Run) -> None:
    answer = run("""
        opened = copies(plugin, helper, generation=2)
        for path in (plugin, helper):
            with path.open("r+b") as file:
                file.write(bytes(path.stat().st_size))
        answer(state(load(*opened)))
    """)
    assert answer == [[1, 10, 100, 1]]


def test_loaded_dependencies(run: Run) -> None:
    answer = run("""
        before = loaded_dependencies(plugin)
        load(plugin)
        after = loaded_dependencies(plugin)
        build(2)
        answer(*([str(path) for path in each] for each in (before, after, loaded_dependencies(plugin))))
    """)
    assert isinstance(answer[1], list)
    assert [Path(path).name for path in answer[1]] == ["libhelper.so"]
    assert (answer[0], answer[2]) == ([], answer[1])


def test_mauve_rt_is_no_dependency_of_a_plug_in(run: Run) -> None:
    answer = run("""
        from mauve_rt._kernel import PluginRegistry
        from mauve_rt.model.plugins import PluginIndex
        plugin = PluginIndex.installed().find("shell", "mauve_examples/MetronomeShell").library
        registry = PluginRegistry()
        registry.load_library(str(plugin))
        copied = copies(plugin, generation=2)
        new = PluginRegistry()
        new.load_library(str(copied[-1]))
        dependencies = [str(path) for path in loaded_dependencies(plugin)]
        answer(dependencies, registry.names("core") == new.names("core"))
    """)
    assert answer == [[], True]


def test_what_may_be_rebuilt(tmp_path: Path) -> None:
    fixed = ["/usr/lib/libx.so", "/lib/libx.so", "/opt/ros/jazzy/lib/librcl.so", os.__file__, pytest.__file__]
    assert [path for path in fixed if may_be_rebuilt(Path(path))] == []
    for path in (
        tmp_path / "lib" / "libx.so",
        Path("/usr/local/lib/libx.so"),
        Path("/opt/robot/lib/libx.so"),
    ):
        assert may_be_rebuilt(path)
    in_workspace = tmp_path / "install" / "lib" / "python3.12" / "site-packages" / "helpers.py"
    assert may_be_rebuilt(in_workspace)


def _refusal(folder: Path, *libraries: Path) -> str:
    copies = folder / "copies"
    copies.mkdir()
    with pytest.raises(PluginError) as caught:
        copy_libraries(libraries, folder=copies, generation=2)
    assert list(copies.iterdir()) == []
    return str(caught.value)


def test_half_written_file(workspace: Path) -> None:
    library = workspace / "libplugin.so"
    size = library.stat().st_size
    os.truncate(library, size // 2)
    text = _refusal(workspace, workspace / "libhelper.so", library)
    assert f"library {library}: expected a table of sections up to byte {size}" in text
    assert f"found {size // 2} bytes; wait for the end of the build" in text


def test_every_length_of_a_half_written_file_is_refused(workspace: Path) -> None:
    library = workspace / "libplugin.so"
    content = library.read_bytes()
    for size in range(0, len(content), 97):
        library.write_bytes(content[:size])
        with pytest.raises(PluginError, match="wait for the end of the build"):
            ElfLibrary(library)


def test_holes_of_a_half_written_file(workspace: Path) -> None:
    library = workspace / "libplugin.so"
    content = library.read_bytes()
    library.write_bytes(bytes(64) + content[64:])
    assert "expected a shared library (ELF)" in _refusal(workspace, library)


def test_file_that_is_no_library(tmp_path: Path) -> None:
    library = tmp_path / "libtext.so"
    library.write_text("INPUT(libother.so) and more text", encoding="utf-8")
    assert "expected a shared library (ELF), found a file that begins with b'INPU'" in _refusal(
        tmp_path, library
    )


def test_library_of_another_machine(workspace: Path) -> None:
    library = workspace / "libplugin.so"
    with library.open("r+b") as file:
        file.seek(18)
        file.write((8).to_bytes(2, "little"))
    assert "found one of machine 8; build it for this machine" in _refusal(workspace, library)


def test_file_that_is_not_there(tmp_path: Path) -> None:
    assert "found No such file or directory" in _refusal(tmp_path, tmp_path / "libnothing.so")


def test_file_that_is_written_while_it_is_read(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = workspace / "libplugin.so"
    original = os.fstat

    def stat_and_write(descriptor: int) -> os.stat_result:
        found = original(descriptor)
        with library.open("ab") as file:
            file.write(b"\0")
        return found

    monkeypatch.setattr(elf_library.os, "fstat", stat_and_write)
    with pytest.raises(PluginError, match="expected a file at rest, found one that is being written"):
        ElfLibrary(library)


def test_pyelftools_is_missing(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "elftools.elf.elffile", None)
    with pytest.raises(PluginError, match=r"pip install pyelftools \(or apt install python3-pyelftools\)"):
        loaded_dependencies(workspace / "libplugin.so")


def test_dependency_without_a_name(tmp_path: Path) -> None:
    helper = _link(tmp_path, "libnameless.so")
    user = _link(tmp_path, "libuser.so", "-lnameless")
    assert "expected a SONAME, as another library needs it, found none" in _refusal(tmp_path, helper, user)


def test_plug_in_without_a_name(tmp_path: Path) -> None:
    """A module of CMake has none; nothing needs it."""
    copies = copy_libraries([_link(tmp_path, "module.so")], folder=tmp_path, generation=2)
    assert [path.name for path in copies] == ["module@2.so"]


def test_one_name_twice(tmp_path: Path) -> None:
    first, second = (_link(tmp_path, name, "-Wl,-soname,libx.so") for name in ("a.so", "b.so"))
    assert "expected a SONAME of its own, found 'libx.so' twice" in _refusal(tmp_path, first, second)


def test_names_within_other_names(run: Run) -> None:
    """Linkers let strings share their ends: `variable` is one of `my_variable`."""
    answer = run("""
        header = "inline int variable = V, my_variable = 10 * V; inline thread_local int local = V;"
        (folder / "helper.hpp").write_text(header + "int helper_version();")
        include = '#include "helper.hpp"\\n'
        (folder / "helper.cpp").write_text(include + "int helper_version() { return V; }")
        functions = 'extern "C" int version() { return helper_version(); }'
        functions += 'extern "C" int objects(int index) {'
        functions += "return index == 0 ? variable : index == 1 ? my_variable : local; }"
        (folder / "plugin.cpp").write_text(include + functions)
        build(1)
        old = load(plugin)
        build(2)
        opened = copies(plugin, helper, generation=2)
        new = load(*opened)
        answer(state(old), state(new), state(old))
    """)
    assert answer == [[1, 10, 1, 1], [2, 20, 2, 2], [1, 10, 1, 1]]


@pytest.mark.parametrize("option", ["--hash-style=both", "-z,noseparate-code", "-s", "-z,now"])
def test_libraries_that_are_linked_otherwise(tmp_path: Path, option: str) -> None:
    text = 'inline int value = V; extern "C" int get() { return value; }'
    library = _link(tmp_path, "libx.so", "-Wl,-soname,libx.so", "-DV=1", f"-Wl,{option}", text=text)
    library.rename(tmp_path / "old.so")
    _link(tmp_path, "libx.so", "-Wl,-soname,libx.so", "-DV=2", f"-Wl,{option}", text=text)
    copies = copy_libraries([library], folder=tmp_path, generation=2)
    assert ElfLibrary(copies[0]).soname == b"libx.so@2"
    load = "import ctypes, sys; print([ctypes.CDLL(path).get() for path in sys.argv[1:]])"
    outcome = subprocess.check_output([sys.executable, "-c", load, tmp_path / "old.so", *copies], text=True)
    assert outcome == "[1, 2]\n"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (
            "-Wl,--hash-style=sysv",
            "expected a hash table of style gnu, found none; link it",
        ),
        (
            "-Wl,--build-id=none",
            "expected a note in its program headers, found none; link it",
        ),
    ],
)
def test_libraries_that_cannot_be_renamed(tmp_path: Path, option: str, message: str) -> None:
    library = _link(
        tmp_path,
        "libx.so",
        "-Wl,-soname,libx.so",
        option,
        text="inline int value; int* get() { return &value; }",
    )
    assert message in _refusal(tmp_path, library)


def test_needed_name_with_a_version_of_symbols(tmp_path: Path) -> None:
    """The table of needed versions names the library once more."""
    (tmp_path / "versions").write_text("V1 { *; };", encoding="utf-8")
    text = 'extern "C" int of_helper() { return 1; }'
    helper = _link(
        tmp_path, "libversioned.so", "-Wl,-soname,libversioned.so", "-Wl,--version-script=versions", text=text
    )
    text = 'extern "C" int of_helper(); extern "C" int of_user() { return of_helper(); }'
    user = _link(tmp_path, "libuser.so", "-lversioned", text=text)
    copies = copy_libraries([user, helper], folder=tmp_path, generation=2)
    helper.unlink()
    load = "import ctypes, sys; print([ctypes.CDLL(path) for path in sys.argv[1:]][-1].of_user())"
    outcome = subprocess.check_output([sys.executable, "-c", load, *copies], text=True)
    assert outcome == "1\n"


def test_a_copy_is_never_written_again(workspace: Path) -> None:
    helper = workspace / "libhelper.so"
    first = copy_libraries([helper], folder=workspace, generation=2)
    content = first[0].read_bytes()
    with pytest.raises(PluginError, match=r"libhelper@2\.so cannot be written: File exists"):
        copy_libraries([helper], folder=workspace, generation=2)
    assert first[0].read_bytes() == content
