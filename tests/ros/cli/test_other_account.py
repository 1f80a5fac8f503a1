"""An ordinary user's `mauve` and root's executor, on one machine."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from ros_processes import PATIENCE_S, ExecutorProcess

from mauve_rt.parts.ament_index import share_folder

USER = 54321  # in no list of accounts
MEMORY = Path("/dev/shm")  # noqa: S108 - Fast DDS's
# As the program, but that it gives up sooner.
MAUVE = """
import sys
from mauve_rt.cli import client, main
client.REPLY_TIMEOUT_S = 3.0
sys.exit(main.main(sys.argv[1:]))
"""

ARCHITECTURE = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  relay: {shell: mauve_rt/Float64RelayShell, core: mauve_rt/Float64Relay, fsm: mauve_rt/Float64RelayFsm}
resources:
  given: {kind: shared_data, type: std_msgs/msg/Float64}
  passed: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [relay.input, given.read]
  - [relay.output, passed.write]
"""


@pytest.fixture
def as_user(domain: int) -> Iterator[Callable[..., tuple[int, str]]]:
    """as_user("list", ..., NAME="value"): exit status and output of `mauve`, run by another account."""
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("needs the right to run a program as another user (root, and setpriv of util-linux)")
    # May read everything, as the interpreter may be in root's home; may write nothing of root's.
    reads = ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]
    wrapper = ["setpriv", f"--reuid={USER}", f"--regid={USER}", "--clear-groups", *reads]
    if subprocess.run([*wrapper, sys.executable, "-c", ""], check=False, capture_output=True).returncode:
        pytest.skip("needs a kernel that lets another user read root's interpreter (ambient capabilities)")

    home = tempfile.mkdtemp()
    os.chown(home, USER, USER)

    def run(*words: str, **environment: str) -> tuple[int, str]:
        done = subprocess.run(
            [*wrapper, sys.executable, "-c", MAUVE, *words],
            env=os.environ | {"ROS_DOMAIN_ID": str(domain), "HOME": home, "TMPDIR": home} | environment,
            cwd="/",
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )
        return done.returncode, done.stdout + done.stderr

    yield run
    shutil.rmtree(home)
    for file in MEMORY.iterdir():
        with contextlib.suppress(FileNotFoundError):
            if file.stat().st_uid == USER:
                file.unlink()


@pytest.fixture
def executor(start_executor: Callable[..., ExecutorProcess], tmp_path: Path) -> ExecutorProcess:
    path = tmp_path / "relay.yaml"
    path.write_text(ARCHITECTURE, encoding="utf-8")
    return start_executor("-p", f"architecture:={path}")


def test_an_ordinary_user_reaches_an_executor_of_root(
    as_user: Callable[..., tuple[int, str]], executor: ExecutorProcess
) -> None:
    executor.wait_begun()
    status, said = as_user("list", "/robot_1/executor")
    assert status == 0, said
    status, said = as_user("stop", "/robot_1/executor", "relay")
    assert (status, said) == (0, "component 'relay' is stopped\n")


def test_one_who_chose_shared_memory_is_told_whose_it_is(
    as_user: Callable[..., tuple[int, str]], executor: ExecutorProcess
) -> None:
    executor.wait_begun()
    status, said = as_user("list", "/robot_1/executor", ROS_STATIC_PEERS="127.0.0.1")
    assert status == 2, said
    assert "no reply from /robot_1/executor/list_components" in said
    assert "is it root's, whose shared memory you may not use?" in said


def test_the_installed_profile_is_for_other_programs(
    as_user: Callable[..., tuple[int, str]], executor: ExecutorProcess
) -> None:
    """As docs/several_machines.md has it: whoever has a profile of Fast DDS is left with it."""
    share = share_folder("mauve_rt")
    assert share is not None
    profile = share / "dds" / "local_udp.xml"
    assert profile.is_file()
    executor.wait_begun()
    said = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT", "FASTRTPS_DEFAULT_PROFILES_FILE": str(profile)}
    status, answer = as_user("list", "/robot_1/executor", **said)
    assert status == 0, answer
