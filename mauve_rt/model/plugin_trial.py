"""A process of its own tries new code before this process loads it.

New code may crash, end the process or never return in its static initialisers. The trial (program:
plugin_trial_process.py) does what this process is about to do, in the same order, and reports what the code
registers.
"""

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mauve_rt.errors import PluginError, one_line
from mauve_rt.model.opened_libraries import opened_libraries

_PROGRAM = "mauve_rt.model.plugin_trial_process"
_READ_BYTES = 65536
_OUTPUT_BYTES = 4096  # of what the code prints, the end
_OUTPUT_LINES = 5
_CORRECT = "correct the code and build it again"


@dataclass
class _Outcome:
    answer: bytearray = field(default_factory=bytearray)
    output: bytearray = field(default_factory=bytearray)
    ended: bool = False
    status: int = 0


def try_plugins(
    libraries: Sequence[Path],
    modules: Sequence[tuple[str, Collection[str]]],
    *,
    generation: int,
    copies: "Copies | None" = None,
    timeout_s: float = 10.0,
) -> dict[str, Any]:
    """Open the libraries and import the modules, in this order, in a process of its own.

    With `copies` that process makes private copies of the libraries first, and of others that go with them;
    it opens these, and the answer has them.

    `modules`: each with its packages, as for load_module(). The answer:

        {"names": {kind: [name, ...]},
         "shells": {name: its shell_layout()},
         "classes": registered_classes(),
         "types": {name: its layout_of()},
         "copied": [library, ...], "opened": [copy, or a library that it needs, ...]}

    Raises:
        PluginError: the code does not load, crashes, ends the process, does not end, or raises.
    """
    request = {
        "parent": os.getpid(),
        "path": [entry for entry in sys.path if isinstance(entry, str)],
        "libraries": [str(library) for library in libraries],
        "modules": [[module, sorted(packages)] for module, packages in modules],
        "generation": generation,
        "copies": None if copies is None else copies.request(),
    }
    return _answer(request, f"trial of generation {generation}", timeout_s)


def needed_libraries(libraries: Sequence[Path], *, timeout_s: float = 10.0) -> dict[str, list[str]]:
    """What loaded_dependencies() finds for each library, for this process.

    Raises:
        PluginError: a file is no complete library, or pyelftools is missing.
    """
    request = {
        "parent": os.getpid(),
        "path": [entry for entry in sys.path if isinstance(entry, str)],
        "needed": [str(library) for library in libraries],
        "of": opened_libraries(),
    }
    return _answer(request, "dependencies of libraries", timeout_s)


@dataclass(frozen=True)
class Copies:
    """What is copied for a generation: the libraries of the trial, and those of `changed` that they need."""

    folder: Path
    changed: Collection[Path]

    def request(self) -> dict[str, Any]:
        """As the other process takes it. Libraries are read there: what that takes of memory goes with it."""
        return {
            "folder": str(self.folder),
            "changed": [str(file) for file in self.changed],
            "of": opened_libraries(),
        }


def _answer(request: dict[str, Any], what: str, timeout_s: float) -> dict[str, Any]:
    try:
        outcome = _run(request, timeout_s)
    except OSError as error:
        text = f"{what}: cannot start a process: {error.strerror}"
        raise PluginError(text, remedy="free memory, processes or file descriptors") from None
    step = ""
    for line in _messages(outcome.answer):
        if "answer" in line:
            answer: dict[str, Any] = line["answer"]
            return answer
        if "error" in line:
            said, remedy = line["error"]  # the text has the remedy, if there is one
            raise PluginError(f"{what}: {said}", remedy="" if remedy else _CORRECT)
        step = f"{line['step']}: "
    text = f"{what}: {step}{_how_it_ended(outcome, timeout_s)}"
    raise PluginError(f"{text}{_last_output(outcome.output)}", remedy=_CORRECT)


def _run(request: dict[str, Any], timeout_s: float) -> _Outcome:
    """Start the trial's process, and wait for its end. Nothing of its process group is left afterwards."""
    until_s = time.monotonic() + timeout_s
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(os.fdopen(os.memfd_create("request"), "w+b"))
        reader, writer = os.pipe()
        stack.callback(os.close, reader)
        with os.fdopen(writer, "wb"):
            source.write(json.dumps({**request, "answer": writer}).encode())
            source.seek(0)
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", _PROGRAM],
                stdin=source,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=(writer,),
                env={**os.environ, "PYTHONPATH": os.pathsep.join(request["path"])},
                start_new_session=True,
            )
        outcome = _Outcome()
        with process:
            try:
                _receive(outcome, process, reader, until_s=until_s)
            finally:
                # Before the process is waited for: its id is its own until then.
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                if process.stdout is not None:
                    process.stdout.close()
                outcome.status = process.wait()
        return outcome


def _receive(outcome: _Outcome, process: "subprocess.Popen[bytes]", reader: int, *, until_s: float) -> None:
    """Collect answer and output until the process ends, not until the pipes do: children may hold those."""
    output = process.stdout.fileno() if process.stdout is not None else -1
    parts = {reader: outcome.answer, output: outcome.output}
    with contextlib.ExitStack() as stack:
        end = os.pidfd_open(process.pid)
        stack.callback(os.close, end)
        selector = stack.enter_context(selectors.DefaultSelector())
        for descriptor in (*parts, end):
            os.set_blocking(descriptor, False)
            selector.register(descriptor, selectors.EVENT_READ)
        while not outcome.ended and (left_s := until_s - time.monotonic()) > 0:
            ready = [key.fd for key, _ in selector.select(left_s)]
            outcome.ended = end in ready
            for descriptor in parts if outcome.ended else ready:
                if not _read(descriptor, parts[descriptor], until_s=until_s) and not outcome.ended:
                    selector.unregister(descriptor)
            del outcome.output[:-_OUTPUT_BYTES]


def _read(descriptor: int, into: bytearray, *, until_s: float) -> bool:
    """Read what there is; False: the pipe has ended."""
    with contextlib.suppress(BlockingIOError):
        while data := os.read(descriptor, _READ_BYTES):
            into += data
            if time.monotonic() > until_s or len(data) < _READ_BYTES:
                return True
        return False
    return True


def _messages(answer: bytearray) -> Iterator[dict[str, Any]]:
    for line in bytes(answer).split(b"\n"):
        with contextlib.suppress(ValueError):  # cut off by the end of the process
            yield json.loads(line)


def _how_it_ended(outcome: _Outcome, timeout_s: float) -> str:
    if not outcome.ended:
        return f"does not end within {timeout_s:g} s"
    if outcome.status < 0:
        number = -outcome.status
        known = number in signal.valid_signals()
        name = signal.Signals(number).name if known and number < signal.SIGRTMIN else f"signal {number}"
        return f"crashed ({name}: {signal.strsignal(number) if known else 'unknown'})"
    return f"ended the process with exit status {outcome.status}"


def _last_output(output: bytearray) -> str:
    lines = bytes(output).decode("utf-8", "replace").strip().splitlines()[-_OUTPUT_LINES:]
    return f"; its last output: {one_line(' | '.join(lines))}" if lines else ""
