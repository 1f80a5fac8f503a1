"""scripts/check_tags.py: which functions have a tag, and where MAUVE_RT must stand."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "check_tags.py"
HEADERS = "mauve_rt/kernel/include/mauve_rt/base"


def check(root: Path, code: str) -> list[str]:
    """What the check says of a header with this code, but for its last line."""
    header = root / HEADERS / "header.hpp"
    header.parent.mkdir(parents=True)
    header.write_text(f"namespace mauve {{\n{code}\n}}  // namespace mauve\n", encoding="utf-8")
    done = subprocess.run([sys.executable, SCRIPT, root], capture_output=True, text=True, check=False)
    *found, last = done.stdout.splitlines()
    assert last == f"{len(found)} functions whose tag is missing or untrue"
    assert done.returncode == (1 if found else 0)
    return [line.removeprefix(f"{HEADERS}/header.hpp:") for line in found]


@pytest.mark.parametrize(
    "code",
    [
        "/// Writes. [rt]\nvoid write(int value) MAUVE_RT;",
        "/// Throws. [non-rt]\nvoid write(int value);",
        "void write(int value) MAUVE_RT;  // [rt]",
        "/// [rt]\nconstexpr int one() MAUVE_RT { return 1; }\nconstexpr int two() MAUVE_RT { return 2; }",
        "/// [rt] as far as the callable is.\ntemplate <typename F>\nvoid call(F&& function) { function(); }",
        "/// [rt] but for the first time\nvoid grow();",
        "/// All functions [rt].\nstruct Pair {\n  int sum() const MAUVE_RT { return a; }\n  int a{};\n};",
        "struct Given {\n  Given() = default;\n  bool operator==(const Given&) const = default;\n};",
        "class Made {\n public:\n  explicit Made(int n) : n_{n} {}\n  ~Made();\n\n private:\n  int n_;\n};",
        "class MAUVE_GUARD Held {\n public:\n  explicit Held(int& n) MAUVE_ACQUIRE(n);\n  ~Held();\n};",
        "struct Derived : Base {\n  void write() noexcept override;\n};",
        "class Secret {\n  void write();\n\n protected:\n  void put();\n};",
        "class Outer {\n  struct Inner {\n    int get();\n  };\n};",
        "namespace detail {\nvoid helper();\n}",
        "struct Fields {\n  time_ns_t wait_ns{s_to_ns(1)};\n  std::function<void()> back{};\n};",
        "struct Fields {\n  int (*call)(int);\n};",
        "using Call = int (*)(int);\ntemplate <typename T>\nconcept Small = requires(T t) { t.small(); };",
        "/// Which. [rt]\nvoid point(Task* task) MAUVE_RT;",
        "#define TWICE(x) \\\n  twice(x)\n",
    ],
)
def test_what_agrees_passes(tmp_path: Path, code: str):
    assert check(tmp_path, code) == []


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("void write(int value);", "2: write() has no tag: [rt], [non-rt] or [setup]"),
        ("/// Writes.\nvoid write();", "3: write() has no tag: [rt], [non-rt] or [setup]"),
        ("/// Writes. [rt]\nvoid write() noexcept;", "3: write() is [rt], but not declared MAUVE_RT"),
        (
            "/// Writes. [non-rt]\nvoid write() MAUVE_RT;",
            "3: write() is declared MAUVE_RT, but tagged [non-rt]",
        ),
        (
            "/// [rt] as far as the core is.\nvoid run() MAUVE_RT;",
            "3: run() is declared MAUVE_RT, but tagged [rt] as far as",
        ),
        (
            "/// Reads. [rt]\nint read() MAUVE_RT;\n\nint write();",
            "5: write() has no tag: [rt], [non-rt] or [setup]",
        ),
        (
            "/// All functions [rt].\nclass Pair {\n public:\n  int sum() const { return 0; }\n};",
            "5: sum() is [rt], but not declared MAUVE_RT",
        ),
        (
            "class Base {\n protected:\n  /// Stamps. [setup]\n  int stamp() const MAUVE_RT;\n};",
            "5: stamp() is declared MAUVE_RT, but tagged [setup]",
        ),
        (
            "class Made {\n public:\n  explicit Made(int n) : n_{n}, m_{n} {}\n  int n() const;\n};",
            "5: n() has no tag: [rt], [non-rt] or [setup]",
        ),
        (
            "struct Call {\n  int operator()(int n) const;\n};",
            "3: operator()() has no tag: [rt], [non-rt] or [setup]",
        ),
    ],
)
def test_what_is_missing_or_untrue_is_named(tmp_path: Path, code: str, expected: str):
    assert check(tmp_path, code) == [expected]
