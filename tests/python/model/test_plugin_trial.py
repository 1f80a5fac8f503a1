"""A process of its own tries new code: what it registers, and every way to fail."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.errors import PluginError
from mauve_rt.model.library_copies import copy_libraries
from mauve_rt.model.plugin_trial import try_plugins
from mauve_rt.model.plugins import PluginIndex

Build = Callable[..., Path]
STATIC = "#include <cstdio>\n#include <cstdlib>\n#include <unistd.h>\nstruct S {{ S() {{ {} }} }} object;"


@pytest.fixture
def build(tmp_path: Path) -> Build:
    if shutil.which("g++") is None:
        pytest.skip("needs g++")

    def build_library(text: str, name: str = "libtried.so", *arguments: str) -> Path:
        source = tmp_path / "source.cpp"
        source.write_text(text, encoding="utf-8")
        command = ["g++", "-shared", "-fPIC", "source.cpp", "-o", name, f"-Wl,-soname,{name}", "-L."]
        subprocess.run([*command, *arguments], cwd=tmp_path, check=True)
        return tmp_path / name

    return build_library


@pytest.fixture
def tutorials() -> Path:
    plugin = PluginIndex.installed().find("shell", "mauve_examples/MetronomeShell")
    assert plugin is not None
    return plugin.library


def _refusal(*libraries: Path, module: str = "", timeout_s: float = 60.0) -> str:
    modules = [(module, [module])] if module else []
    with pytest.raises(PluginError) as caught:
        try_plugins(libraries, modules, generation=2, timeout_s=timeout_s)
    text = str(caught.value)
    assert text.startswith("trial of generation 2: ")
    assert text.endswith("; correct the code and build it again")
    assert "\n" not in text
    return text


def _hang_refusal(*libraries: Path, module: str = "", output: str) -> str:
    """Of a trial that had the time to come so far."""
    for timeout_s in (1.0, 4.0, 16.0, 64.0):
        text = _refusal(*libraries, module=module, timeout_s=timeout_s)
        if f"does not end within {timeout_s:g} s; its last output: {output}" in text:
            return text
    pytest.fail(text)


def _children() -> list[str]:
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="utf-8").split()


def _runs(group: int) -> bool:
    """Whether a process of the group is alive."""
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, of_group = status.read_text(encoding="utf-8").rpartition(")")[2].split()[:3]
            if int(of_group) == group and state not in "ZX":
                return True
    return False


def test_what_a_library_registers(tutorials: Path) -> None:
    answer = try_plugins([tutorials], [], generation=2)
    shell = "mauve_examples/MetronomeShell"
    assert shell in answer["names"]["shell"]
    assert {"mauve_examples/Accelerando", "mauve_examples/Metronome"} <= {*answer["names"]["core"]}
    size, ports, properties = answer["shells"][shell]
    assert size > 0
    assert ports == [["beat", "write", "std_msgs/msg/Float64"]]
    assert properties[0] == ["period_us", "int"]
    assert answer["types"]["std_msgs/msg/Float64"] == {
        "bytes": 8,
        "fields": {"data": "float64 at byte 0"},
    }


def test_copies_of_a_plug_in_library(tutorials: Path, tmp_path: Path) -> None:
    copies = copy_libraries([tutorials], folder=tmp_path, generation=2)
    assert [copy.name for copy in copies if copy.parent == tmp_path] == ["libmauve_tutorials@2.so"]
    of_copies, of_library = (try_plugins(each, [], generation=2) for each in (copies, [tutorials]))
    assert of_copies.pop("opened") != of_library.pop("opened")
    assert of_copies == of_library


def test_dependency_without_plug_ins(build: Build) -> None:
    library = build("int of_it;")
    assert try_plugins([library], [], generation=2)["names"]["shell"] == []


def test_library_that_needs_a_plug_in_library(build: Build, tutorials: Path) -> None:
    """It has no plug-ins of its own, and does not register those again."""
    link = ["-Wl,--no-as-needed", str(tutorials), f"-Wl,-rpath,{tutorials.parent}"]
    library = build("int of_it;", "libneeds.so", *link)
    alone = try_plugins([tutorials], [], generation=2)["names"]
    assert try_plugins([tutorials, library], [], generation=2)["names"] == alone


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("abort();", "crashed (SIGABRT: Aborted)"),
        ("raise(11);", "crashed (SIGSEGV: Segmentation fault)"),
        ("*(volatile int*)8 = 1;", "crashed (SIGSEGV: Segmentation fault)"),
        ("exit(0);", "ended the process with exit status 0"),
        ("_exit(3);", "ended the process with exit status 3"),
        ("throw 1;", "crashed (SIGABRT: Aborted)"),
        (
            'for (int i = 0; i < 9999; ++i) fprintf(stderr, "line %d\\n", i); abort();',
            "Aborted); its last output: line 9994 | line 9995 | line 9996 | line 9997 | line 9998",
        ),
    ],
)
def test_static_initialisers_that_end_the_process(build: Build, statement: str, message: str) -> None:
    good = build("int of_it;", "libgood.so")
    text = STATIC.format(statement) + "\n"
    library = build(text.replace("#include <unistd.h>", "#include <unistd.h>\n#include <csignal>"))
    refusal = _refusal(good, library)
    assert f"opening library {library}: {message}" in refusal or message in refusal
    assert str(good) not in refusal


def test_static_initialiser_that_does_not_end(build: Build) -> None:
    library = build(STATIC.format('puts("waits"); fflush(stdout); for (;;) sleep(1);'))
    assert f"opening library {library}: does not end" in _hang_refusal(library, output="waits")
    assert _children() == []


def test_processes_of_the_code_end_with_the_trial(build: Build, tmp_path: Path) -> None:
    note = tmp_path / "process"
    statement = f'if (fork() == 0) for (;;) sleep(1); FILE* f = fopen("{note}", "w"); '
    statement += 'fprintf(f, "%d", getpgrp()); fclose(f);'
    try_plugins([build(STATIC.format(statement))], [], generation=2)
    group = int(note.read_text(encoding="utf-8"))
    while _runs(group):  # the kill is sent before the trial ends, and carried out later
        time.sleep(0.01)


def test_missing_symbol(build: Build) -> None:
    library = build("int missing_function(); int value = missing_function();")
    text = _refusal(library)
    assert f"library {library} does not load: " in text
    assert "undefined symbol: _Z16missing_functionv" in text


def test_a_library_without_room_in_static_tls(build: Build) -> None:
    tls = '__thread char room[65536] __attribute__((tls_model("initial-exec"))); char* get() { return room; }'
    library = build(tls)
    with pytest.raises(PluginError, match="cannot allocate memory in static TLS block") as caught:
        try_plugins([library], [], generation=2)
    assert "GLIBC_TUNABLES=glibc.rtld.optional_static_tls=65536" in str(caught.value)
    assert "build it again" not in str(caught.value)


def test_file_that_is_no_library(tmp_path: Path) -> None:
    library = tmp_path / "libtext.so"
    library.write_text("text", encoding="utf-8")
    assert "does not load: " in _refusal(library)


def test_library_of_another_build_of_mauve_rt(build: Build) -> None:
    library = build('extern "C" void mauve_register_plugins(void*) {}')
    with pytest.raises(PluginError, match="found headers of another build; rebuild") as caught:
        try_plugins([library], [], generation=2)
    assert str(caught.value).endswith("this version")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("import json\nraise ValueError('no map')", "tried_core.py:2: ValueError: no map"),
        ("def broken(:", "SyntaxError"),
        ("import sys\nsys.exit(4)", "SystemExit: 4"),
        ("import os\nos._exit(4)", "importing module tried_core: ended the process with exit status 4"),
        ("import os\nprint('x', flush=True)\nos.abort()", "crashed (SIGABRT: Aborted); its last output: x"),
        ("import os\nos.close(0)\nraise KeyError(1)", "KeyError: 1"),
    ],
)
def test_modules_that_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "tried_core.py").write_text(text, encoding="utf-8")
    assert message in _refusal(module="tried_core")
    assert not [name for name in sys.modules if name.startswith("tried_core")]


def test_module_that_does_not_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "tried_core.py").write_text("while True:\n    print('x' * 9999)\n", encoding="utf-8")
    assert "importing module tried_core: does not" in _hang_refusal(module="tried_core", output="xxx")
    assert _children() == []


def test_module_of_the_generation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    text = "assert __name__ == 'tried_core@7'\nimport tried_helper\n"
    text += "assert tried_helper.__name__ == 'tried_helper@7'"
    (tmp_path / "tried_core.py").write_text(text, encoding="utf-8")
    (tmp_path / "tried_helper.py").write_text("", encoding="utf-8")
    try_plugins([], [("tried_core", ["tried_core", "tried_helper"])], generation=7)


def test_the_trial_ends_with_its_parent(tmp_path: Path) -> None:
    note = tmp_path / "process"
    code = f"import os, time\nopen({str(note)!r}, 'w').write(str(os.getpid()) + '.')\n"
    code += "while True: time.sleep(1)"
    (tmp_path / "tried_core.py").write_text(code, encoding="utf-8")
    program = "from mauve_rt.model.plugin_trial import try_plugins\n"
    program += "try_plugins([], [('tried_core', [])], generation=2, timeout_s=600)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *filter(None, sys.path)])}
    with subprocess.Popen([sys.executable, "-c", program], env=environment) as parent:
        while not (note.is_file() and note.read_text(encoding="utf-8").endswith(".")):
            time.sleep(0.01)
        parent.send_signal(signal.SIGKILL)
    trial = Path("/proc") / note.read_text(encoding="utf-8").removesuffix(".")
    while trial.is_dir() and ") Z" not in (trial / "stat").read_text(encoding="utf-8"):
        time.sleep(0.01)
