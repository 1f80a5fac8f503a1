"""A wait of the middleware that fails ends no thread: what comes later is received."""

import os
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ros_processes import ExecutorProcess
from std_msgs.msg import Float64

from mauve_msgs.srv import ReadValues, Stop

NODE = "/robot_1/executor"
# Lets waits of the bridge fail while there is a file; those of rclpy do not.
FAILING = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int rcl_wait(void* set, int64_t timeout) {
  static int (*real)(void*, int64_t);
  Dl_info caller;
  if (!real) real = dlsym(dlopen("librcl.so", RTLD_LAZY | RTLD_NOLOAD), "rcl_wait");
  if (dladdr(__builtin_return_address(0), &caller) && strstr(caller.dli_fname, "/_bridge.") &&
      access(getenv("MAUVE_TEST_FAILING"), F_OK) == 0)
    return 1;
  return real(set, timeout);
}
"""


@pytest.fixture
def failing(tmp_path: Path) -> dict[str, str]:
    """The environment in which waits fail while there is a file, which it names."""
    library = tmp_path / "failing.so"
    command = ["gcc", "-shared", "-fPIC", "-x", "c", "-", "-o", library, "-ldl"]
    subprocess.run(command, input=FAILING, text=True, check=True)
    return {"LD_PRELOAD": str(library), "MAUVE_TEST_FAILING": str(tmp_path / "fails")}


def test_messages_and_stops_are_received_after_a_failure(
    start_executor: Callable[..., ExecutorProcess],
    architecture: Path,
    graph: Any,
    failing: dict[str, str],
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", environment=failing)
    speak = graph.voice(Float64, "/robot_1/set")

    def value() -> float:
        (shown,) = graph.ask(ReadValues, f"{NODE}/read_values", names=["set"]).values
        return float(struct.unpack_from("<d", bytes(shown.data), 4)[0]) if shown.data else 0.0

    speak.publish(Float64(data=1.0))
    graph.spin_until(lambda: value() == 1.0, "the first value")
    fails = Path(failing["MAUVE_TEST_FAILING"])
    fails.touch()
    speak.publish(Float64(data=2.0))  # the wait that was under way ends, and the next one fails
    executor.await_output("waiting for messages and requests failed, and is tried again")
    fails.unlink()

    def is_third_there() -> bool:
        speak.publish(Float64(data=3.0))
        return value() == 3.0

    graph.spin_until(is_third_there, "a value after the failure")
    assert graph.ask(Stop, f"{NODE}/stop", component="counter").success
    assert os.access(f"/proc/{executor.process.pid}", os.F_OK)
