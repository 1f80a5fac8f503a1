"""Libraries for LD_PRELOAD: a system call that hangs or fails, in a process that a test starts."""

import shutil
import subprocess
from pathlib import Path

import pytest


def shared_library(source: Path, text: str) -> str:
    """Compile C; returns the library."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler")
    source.write_text(text, encoding="utf-8")
    library = source.with_suffix(".so")
    words = [compiler, "-shared", "-fPIC", "-o", library, source, "-ldl"]
    subprocess.run(words, check=True, timeout=120)
    return str(library)


def started_with(library: str, program: Path, wrapper: Path) -> Path:
    """Write a program that starts another one with that library."""
    wrapper.write_text(f'#!/bin/sh\nLD_PRELOAD="{library}" exec "{program}" "$@"\n', encoding="utf-8")
    wrapper.chmod(0o755)
    return wrapper


DISK_CALLS = r"""
// Appends each call that changes or syncs a file to LOG. While FAULT holds "CALL ERRNO", that call on a file
// whose name has ".mcap" or "metadata" fails.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static int fails(const char* call, int file) {
  char link[64], name[4096], line[4200];
  snprintf(link, sizeof(link), "/proc/self/fd/%d", file);
  ssize_t length = readlink(link, name, sizeof(name) - 1);
  name[length < 0 ? 0 : length] = 0;
  const char* base = strrchr(name, '/');
  int log = syscall(SYS_openat, AT_FDCWD, LOG, O_WRONLY | O_APPEND | O_CREAT, 0600);
  int size = snprintf(line, sizeof(line), "%s %s\n", call, base == NULL ? name : base + 1);
  syscall(SYS_write, log, line, size);
  syscall(SYS_close, log);
  char fault[64] = "", failing[32] = "";
  int number = 0, descriptor = syscall(SYS_openat, AT_FDCWD, FAULT, O_RDONLY, 0);
  if (descriptor < 0) return 0;
  syscall(SYS_read, descriptor, fault, sizeof(fault) - 1);
  syscall(SYS_close, descriptor);
  if (sscanf(fault, "%31s %d", failing, &number) != 2 || strcmp(failing, call) != 0) return 0;
  if (strstr(name, ".mcap") == NULL && strstr(name, "metadata") == NULL) return 0;
  errno = number;
  return 1;
}

ssize_t pwrite(int file, const void* data, size_t length, off_t offset) {
  return fails("pwrite", file) ? -1 : syscall(SYS_pwrite64, file, data, length, offset);
}
ssize_t pwrite64(int file, const void* data, size_t length, off_t offset) {
  return pwrite(file, data, length, offset);
}
int fdatasync(int file) { return fails("fdatasync", file) ? -1 : syscall(SYS_fdatasync, file); }
int fsync(int file) { return fails("fsync", file) ? -1 : syscall(SYS_fsync, file); }
int renameat(int from, const char* old, int to, const char* new) {
  return fails("renameat", from) ? -1 : syscall(SYS_renameat2, from, old, to, new, 0);
}
"""


class DiskCalls:
    """A keeper whose calls of the disk are seen, and fail where a test says so."""

    def __init__(self, keeper: Path, folder: Path) -> None:
        self._log, self._fault = folder / "calls", folder / "fault"
        defined = f'#define LOG "{self._log}"\n#define FAULT "{self._fault}"\n'
        library = shared_library(folder / "disk_calls.c", defined + DISK_CALLS)
        self.keeper = started_with(library, keeper, folder / "keeper")

    def fail(self, call: str, error: int) -> None:
        """Let a call fail from now on."""
        beside = self._fault.with_suffix(".new")
        beside.write_text(f"{call} {error}", encoding="utf-8")
        beside.rename(self._fault)

    def succeed(self) -> None:
        """Let no call fail any longer."""
        self._fault.unlink()

    def seen(self) -> list[str]:
        """Each call and the name of its file."""
        return self._log.read_text(encoding="utf-8").splitlines() if self._log.exists() else []
