#!/usr/bin/env python3
"""Check the dependencies that no other tool sees.

C++ includes point one way: kernel <- rules <- bindings, bridge; in the kernel a storey includes only those
below it. What waits, wakes, reads a clock or is atomic is in the seam alone, which a test build can replace.
Examples and benchmarks use what is public only: the headers <mauve_rt/*.hpp>, and of the Python package
nothing whose name starts with an underscore. import-linter checks the layers inside the Python packages; it
sees no compiled module.

    scripts/check_includes.py [ROOT]

Prints one line per offending line and exits 1 when there is one.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from dataclasses import dataclass
from pathlib import Path

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCES = {".cpp", ".hpp", ".h", ".cc"}

ROS = r"(rcl|rclcpp|rcutils|rcpputils|rmw|rosidl|ament|fastrtps|fastcdr)\w*/|\w+_msgs/|\w+_interfaces/"
PYTHON = r"pybind11/|Python\.h|pyconfig\.h"


@dataclass(frozen=True)
class Rule:
    """Files under `folder` must not include what matches `forbidden`."""

    folder: str
    forbidden: re.Pattern[str]
    reason: str


def rule(folder: str, forbidden: str, reason: str) -> Rule:
    """Build a rule; `forbidden` is matched at the start of the included path."""
    return Rule(folder=folder, forbidden=re.compile(forbidden), reason=reason)


RULES = (
    rule("mauve_rt/kernel", ROS, "the kernel does not know ROS"),
    rule("mauve_rt/kernel", PYTHON, "the kernel does not know Python"),
    rule("mauve_rt/kernel", r"mauve_examples/", "the kernel does not know the examples"),
    rule("mauve_rt/kernel", r"mauve_rt/rules/", "rules stand on the kernel, not the kernel on them"),
    rule("mauve_rt/rules", ROS, "rules are at work where there is no ROS"),
    rule("mauve_rt/rules", PYTHON, "rules are at work where there is no Python"),
    rule("mauve_rt/rules", r"mauve_examples/", "rules do not know the examples"),
    rule("mauve_rt/driver", ROS, "a driver needs the standard library only"),
    rule("mauve_rt/driver", r"mauve_rt/(?!driver/)", "a driver needs the standard library only"),
    rule("mauve_rt/bindings", ROS, "bindings translate the kernel only; ROS belongs in the bridge"),
    rule("mauve_rt/bindings", r"mauve_examples/", "bindings do not know the examples"),
    rule("mauve_rt/bridge", r"mauve_examples/", "the bridge does not know the examples"),
    rule("tests/rules", ROS + "|" + PYTHON, "tests of rules run where there is neither ROS nor Python"),
    rule("tests/kernel", ROS + "|" + PYTHON, "kernel tests run where there is neither ROS nor Python"),
)

KERNEL = "mauve_rt/kernel"
# Each knows only those before it.
STOREYS = ("base", "data", "parts", "run", "architecture", "change", "deploy", "elements")
# Includes that still point up: (file, included path).
UPWARD = {
    ("architecture/architecture.cpp", "mauve_rt/change/transaction_commit.hpp"),
    ("include/mauve_rt/architecture/architecture.hpp", "mauve_rt/change/transaction.hpp"),
    ("run/component.cpp", "mauve_rt/architecture/architecture.hpp"),
    ("run/component.cpp", "mauve_rt/change/transaction_commit.hpp"),
    ("run/component_fallback.cpp", "mauve_rt/architecture/architecture.hpp"),
    ("run/component_fallback.cpp", "mauve_rt/architecture/plugin.hpp"),
}

# In the seam alone these parts wait, wake, read a clock, make threads and have atomics of the system.
SEEDED_PARTS = KERNEL, "mauve_rt/rules", "mauve_rt/bridge"
SEAM = f"{KERNEL}/base/seam", f"{KERNEL}/include/mauve_rt/base/seam"
OF_THE_SEAM = re.compile(
    r"#\s*include\s*<(?:barrier|condition_variable|future|latch|linux/futex\.h|linux/membarrier\.h|mutex|poll\.h"
    r"|semaphore|semaphore\.h|shared_mutex|stop_token|sys/epoll\.h|sys/eventfd\.h|sys/timerfd\.h|thread)>"
    r"|\bstd::(?:(?:recursive_|shared_|timed_|recursive_timed_|shared_timed_)?mutex|condition_variable(?:_any)?"
    r"|j?thread\b(?!::id)|async|call_once|this_thread::(?:sleep_\w+|yield)"
    r"|chrono::(?:steady|system|high_resolution)_clock)\b"
    r"|\bpthread_(?:mutex|cond|rwlock|spin|barrier)_\w+|\bpthread_(?:create|join|detach|timedjoin_np|clockjoin_np)\b"
    r"|\b(?:clock_gettime|clock_nanosleep|nanosleep|usleep|sched_yield|gettimeofday|sigwait\w*|sigtimedwait"
    r"|pthread_getcpuclockid|SYS_futex\w*|SYS_membarrier)\b"
)

# atomic_thread_fence and atomic_ref have no form under the seeded scheduler so far.
ATOMIC = re.compile(r"#\s*include\s*<(?:atomic|stdatomic\.h)>|\bstd::atomic_?\w*|\b__(?:atomic|sync)_\w+")
# Atomics that are no possible switch under the seeded scheduler.
PLAIN_ATOMICS = {
    # Operators new count: the scheduler itself allocates.
    f"{KERNEL}/base/allocation.hpp",
    f"{KERNEL}/base/allocation.cpp",
    f"{KERNEL}/base/thread_counters.cpp",
    f"{KERNEL}/include/mauve_rt/base/thread_counters.hpp",
    # Writes pages that belong to others, each with the byte that it has.
    f"{KERNEL}/base/prefault.cpp",
}

# Of the bridge these do not run under the seeded scheduler.
BY_THE_SYSTEM = tuple(
    f"mauve_rt/bridge/src/{name}." for name in ("console", "node_watch", "steady_waits", "stop_guard")
)

# Examples and benchmarks see the kernel as any user does: by the door and by headers of storeys.
PUBLIC_ONLY = ("mauve_examples", "benchmarks")
PRIVATE_PATH = re.compile(r"(\.\./)+mauve_rt/|.*\bkernel/|mauve_rt/.*\.(h|cpp)$|(" + "|".join(STOREYS) + ")/")


def includes(path: Path) -> list[tuple[int, str]]:
    """Return (line number, included path) of every include in the file."""
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        match = INCLUDE.match(line)
        if match:
            found.append((number, match.group(2)))
    return found


def cpp_files(folder: Path) -> list[Path]:
    """Return every C++ file under the folder, sorted."""
    return sorted(path for path in folder.rglob("*") if path.suffix in SOURCES and path.is_file())


def imported_names(tree: ast.Module) -> list[tuple[int, str]]:
    """Return (line number, full dotted name) of everything a Python file imports."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found += [(node.lineno, f"{node.module}.{alias.name}") for alias in node.names]
    return found


def is_private(name: str) -> bool:
    """Say whether a dotted name is a private part of mauve_rt."""
    package, *parts = name.split(".")
    return package == "mauve_rt" and any(part.startswith("_") and not part.endswith("__") for part in parts)


def private_imports(root: Path, folder: str) -> list[str]:
    """Return one line per import of a private part of mauve_rt in a folder's Python files."""
    lines = []
    for path in sorted((root / folder).rglob("*.py")):
        names = imported_names(ast.parse(path.read_text(encoding="utf-8")))
        lines += [
            f"{path.relative_to(root)}:{number}: imports {name}: only public modules of mauve_rt"
            for number, name in names
            if is_private(name)
        ]
    return lines


def storey(path: str) -> int | None:
    """Return the number of the kernel's storey that a path inside it, or an included path, belongs to."""
    folder = path.removeprefix("include/").removeprefix("mauve_rt/").partition("/")[0]
    return STOREYS.index(folder) if folder in STOREYS else None


def upward_includes(kernel: Path) -> list[str]:
    """Return one line per include of a higher storey of the kernel, and per exception that is none."""
    lines, exceptions = [], set(UPWARD)
    for path in cpp_files(kernel):
        name = path.relative_to(kernel).as_posix()
        own = storey(name)
        if own is None and name != "include/mauve_rt/mauve_rt.hpp":
            lines.append(f"{KERNEL}/{name}: in no storey: one of {', '.join(STOREYS)}")
        for number, included in includes(path):
            other = storey(included)
            if own is None or other is None or other <= own:
                continue
            if (name, included) in UPWARD:
                exceptions.discard((name, included))
            else:
                why = f"{STOREYS[own]} does not know {STOREYS[other]}"
                lines.append(f"{KERNEL}/{name}:{number}: includes {included}: {why}")
    return lines + [f"{KERNEL}/{name} does not include {included} any more" for name, included in exceptions]


def past_the_seam(root: Path) -> list[str]:
    """Return one line per place where a seeded part does by itself what the seam is for."""
    lines = []
    exceptions = set(PLAIN_ATOMICS)
    for path in [file for part in SEEDED_PARTS for file in cpp_files(root / part)]:
        name = path.relative_to(root).as_posix()
        if path.relative_to(root).parent.as_posix() in SEAM or name.startswith(BY_THE_SYSTEM):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            code = line.partition("//")[0]
            found = OF_THE_SEAM.search(code)
            if atomic := ATOMIC.search(code):
                exceptions.discard(name)
                found = found or (None if name in PLAIN_ATOMICS else atomic)
            if found:
                lines.append(f"{name}:{number}: {found.group()}: use mauve_rt/base/seam/")
    return lines + [f"{name} has no std::atomic any more" for name in sorted(exceptions)]


def violations(root: Path) -> list[str]:
    """Return one line per include or import that breaks a rule."""
    lines = upward_includes(root / KERNEL) + past_the_seam(root)
    for item in RULES:
        for path in cpp_files(root / item.folder):
            lines += [
                f"{path.relative_to(root)}:{number}: includes {name}: {item.reason}"
                for number, name in includes(path)
                if item.forbidden.match(name)
            ]
    for folder in PUBLIC_ONLY:
        for path in cpp_files(root / folder):
            lines += [
                f"{path.relative_to(root)}:{number}: includes {name}: only public headers, <mauve_rt/*.hpp>"
                for number, name in includes(path)
                if PRIVATE_PATH.match(name)
            ]
        lines += private_imports(root, folder)
    return lines


def main() -> int:
    """Check the tree and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parent.parent)
    found = violations(parser.parse_args().root)
    for line in found:
        sys.stdout.write(line + "\n")
    sys.stdout.write(f"{len(found)} forbidden includes and imports\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
