"""scripts/check_includes.py: what waits, wakes, reads a clock or is atomic is in the seam alone."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = ROOT / "scripts" / "check_includes.py"
REMEDY = "use mauve_rt/base/seam/"


def check(root: Path, file: str, code: str) -> list[str]:
    """What the check says of a file with this code, but for missing includes and its last line."""
    path = root / "mauve_rt" / file
    path.parent.mkdir(parents=True)
    path.write_text(code, encoding="utf-8")
    done = subprocess.run([sys.executable, SCRIPT, root], capture_output=True, text=True, check=False)
    return [line for line in done.stdout.splitlines()[:-1] if "any more" not in line]


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("#include <mutex>", "#include <mutex>"),
        ("#include <shared_mutex>", "#include <shared_mutex>"),
        ("#include <condition_variable>", "#include <condition_variable>"),
        ("#include <thread>", "#include <thread>"),
        ("#include <linux/futex.h>", "#include <linux/futex.h>"),
        ("std::mutex mutex;", "std::mutex"),
        ("std::recursive_mutex mutex;", "std::recursive_mutex"),
        ("std::thread([] {}).detach();", "std::thread"),
        ("std::this_thread::sleep_for(kLook);", "std::this_thread::sleep_for"),
        ("const auto now = std::chrono::steady_clock::now();", "std::chrono::steady_clock"),
        ("clock_nanosleep(CLOCK_MONOTONIC, 0, &kLook, nullptr);", "clock_nanosleep"),
        ("clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);", "clock_gettime"),
        ("syscall(SYS_futex, &word);", "SYS_futex"),
        ("syscall(SYS_membarrier, 0, 0, 0);", "SYS_membarrier"),
        ("pthread_mutex_lock(&mutex_);", "pthread_mutex_lock"),
        ("#include <atomic>", "#include <atomic>"),
        ("std::atomic<int> count{0};", "std::atomic"),
        ("std::atomic_thread_fence(std::memory_order_seq_cst);", "std::atomic_thread_fence"),
        ("std::atomic_ref(byte).fetch_or(0);", "std::atomic_ref"),
        ("std::atomic_flag is_set;", "std::atomic_flag"),
        ("__atomic_store_n(&count, 1, __ATOMIC_RELEASE);", "__atomic_store_n"),
        ("pthread_create(&thread, nullptr, run, nullptr);", "pthread_create"),
    ],
)
@pytest.mark.parametrize(
    "file",
    [
        "kernel/run/task.cpp",
        "rules/engine.cpp",
        "rules/include/mauve_rt/rules/a.hpp",
        "bridge/src/bridge.cpp",
    ],
)
def test_what_goes_past_the_seam_is_found(tmp_path: Path, file: str, code: str, found: str):
    assert check(tmp_path, file, f"\n{code}\n") == [f"mauve_rt/{file}:2: {found}: {REMEDY}"]


@pytest.mark.parametrize(
    ("file", "code"),
    [
        ("kernel/base/seam/futex.cpp", "#include <linux/futex.h>\nsyscall(SYS_futex, &word);\n"),
        ("kernel/include/mauve_rt/base/seam/mutex.hpp", "#include <mutex>\nstd::mutex mutex;\n"),
        ("kernel/run/task.cpp", "sleep_for(kLook);  // std::mutex, clock_gettime\nstd::thread::id thread;\n"),
        ("kernel/include/mauve_rt/base/seam/atomic.hpp", "#include <atomic>\n"),
        ("kernel/base/allocation.hpp", "#include <atomic>\nstd::atomic<int>* allocation_counter();\n"),
        ("kernel/run/task.cpp", "Atomic<int> count{0};\ncount.load(std::memory_order_relaxed);\n"),
        ("bridge/src/node_watch.hpp", "#include <thread>\nstd::atomic<int> count{0};\n"),
    ],
)
def test_what_the_seam_has_passes(tmp_path: Path, file: str, code: str):
    assert check(tmp_path, file, code) == []


def test_the_sources_keep_to_the_seam():
    done = subprocess.run([sys.executable, SCRIPT, ROOT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
