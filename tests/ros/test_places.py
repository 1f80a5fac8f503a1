"""Folders that a computer lacks or protects: programs work there, or refuse in one line with the remedy."""

import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from rebuilt_package import ROBOT, RebuiltPackage
from ros_processes import PATIENCE_S

from mauve_rt import _kernel
from mauve_rt.parts.ament_index import share_folder

PREFIX = Path(_kernel.__file__).resolve().parents[4]
PROGRAMS = (PREFIX, Path(sys.prefix))
NODE = "/robot_1/executor"
BAD_INPUT = 2
GROUPS = Path("/sys/fs/cgroup/cpu")
NO_REMEDY = ""
READ_ONLY = "mount -o remount,ro {}"
FULL = "! dd if=/dev/zero of={}/all bs=4k count=99 2>/dev/null"
NO_SHARED_MEMORY = (  # the devices that programs need, and no folder /dev/shm
    "mkdir /mnt/dev && mount --rbind /dev /mnt/dev && mount -t tmpfs none /dev && "
    "for name in null zero full random urandom tty; do touch /dev/$name && "
    "mount --bind /mnt/dev/$name /dev/$name; done && ln -s /proc/self/fd /dev/fd"
)


@dataclass(frozen=True)
class Place:
    """Folders as tmpfs of their own, each with what is done to it; HOME is home/ of the test."""

    folders: Mapping[str, tuple[str, str]]
    """By folder: mount options, and a command; `{}` is the folder."""
    environment: Mapping[str, str] = field(default_factory=dict)
    also: str = ":"
    reload_remedy: str = NO_REMEDY
    """The end of the line that refuses a reload; "" where a reload works."""


def _all(options: str, command: str, *folders: str) -> dict[str, tuple[str, str]]:
    return dict.fromkeys(folders, (options, command))


TEMPORARY = ("/tmp", "/var/tmp")  # noqa: S108 - mounted in a namespace of the test's own
EVERY = (*TEMPORARY, "/dev/shm", "{home}")  # noqa: S108
SET_TMPDIR = "set TMPDIR of the executor to a folder that is writable, without noexec"
PLACES = {
    "read-only /tmp": Place(_all("size=1m", READ_ONLY, *TEMPORARY)),
    "read-only /tmp and HOME": Place(_all("size=1m", READ_ONLY, *TEMPORARY, "{home}")),
    "noexec /tmp": Place(_all("size=9m,noexec", ":", *TEMPORARY)),
    "read-only everywhere": Place(_all("size=1m", READ_ONLY, *EVERY), reload_remedy=SET_TMPDIR),
    "noexec everywhere": Place(_all("size=99m,noexec", ":", *EVERY), reload_remedy=SET_TMPDIR),
    "no /dev/shm": Place({}, also=NO_SHARED_MEMORY),
    "read-only /dev/shm": Place(_all("size=1m", READ_ONLY, "/dev/shm")),  # noqa: S108
    "full /tmp": Place(_all("size=64k", FULL, *TEMPORARY)),
    "small /dev/shm": Place(_all("size=200k", ":", "/dev/shm")),  # noqa: S108
    "full HOME": Place(_all("size=64k", FULL, "{home}")),
    "missing HOME and TMPDIR": Place({}, {"HOME": "/proc/none", "TMPDIR": "/proc/none"}),
}


def _wrapper(place: Place, kept: Path) -> tuple[str, ...]:
    """A wrapper that makes the place in a mount namespace.

    `kept` is as everywhere else, also below /tmp; as are the programs, where the clone is there.
    """
    steps = ["mount --make-rprivate /", "mount -t tmpfs none /mnt"]
    keeping = {f"/mnt/{number}": folder for number, folder in enumerate((kept, *PROGRAMS))}
    for at, folder in keeping.items():
        steps += [f"mkdir {at}", f"mount --bind {shlex.quote(str(folder))} {at}"]
    for name, (options, command) in place.folders.items():
        mounted = shlex.quote(name.format(home=kept / "home"))
        steps += [f"mkdir -p {mounted}", f"mount -t tmpfs -o mode=1777,{options} none {mounted}"]
        for at, folder in keeping.items():
            if folder.is_relative_to(name):
                keep = shlex.quote(str(folder))
                steps += [f"mkdir -p {keep}", f"mount --bind {at} {keep}"]
        steps.append(command.format(mounted))
    return ("unshare", "-m", "sh", "-c", f'{" && ".join([*steps, place.also])} && exec "$@"', "sh")


@pytest.fixture
def mounts() -> None:
    probe = ["unshare", "-m", "sh", "-c", "mount -t tmpfs none /mnt"]
    done = subprocess.run(probe, check=False, capture_output=True, text=True, timeout=PATIENCE_S)
    if done.returncode != 0:
        pytest.skip(f"no folder can be mounted in a namespace: {done.stderr.strip()}")


@pytest.mark.usefixtures("mounts")
@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_every_verb_works_or_names_the_remedy(
    place: Place,
    rebuilt: RebuiltPackage,
    start_executor: Callable[..., Any],
    tmp_path: Path,
    domain: int,
) -> None:
    kept = rebuilt.builds.parent  # all that tests of this session write
    (kept / "home").mkdir(exist_ok=True)
    (tmp_path / "wörk").mkdir()
    folder = tmp_path / "my robot"
    folder.symlink_to(tmp_path / "wörk")  # everywhere a link, a blank, and a letter beyond ASCII
    (folder / "robot.yaml").write_text(ROBOT, "utf-8")
    wrapper = _wrapper(place, kept)
    given = {"HOME": str(kept / "home"), "ROS_DOMAIN_ID": str(domain), **place.environment}
    executor = start_executor(
        "-p",
        f"architecture:={folder}/robot.yaml",
        "-p",
        f"bags:={folder}",
        wrapper=wrapper,
        environment=given,
    )

    def mauve(*words: str) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [*wrapper, PREFIX / "bin" / "mauve", *words],
            env={**os.environ, **given},
            cwd="/proc",  # nothing can be written here, too
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )
        assert "Traceback" not in done.stdout + done.stderr
        return done

    def works(*words: str) -> str:
        done = mauve(*words)
        assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}\n{executor.output}"
        return done.stdout

    assert "loop" in works("list", NODE)
    works("record", "start", NODE, "bag")
    rebuilt.build("STEP=2.0")
    reload = mauve("reload", NODE)
    if place.reload_remedy:
        assert (reload.returncode, place.reload_remedy in reload.stderr) == (1, True), reload
    else:
        assert reload.returncode == 0, f"{reload.stdout}{reload.stderr}"
        assert str(rebuilt.library) in reload.stdout
    dev = mauve("dev", NODE, "--build", "true", "--watch", str(folder), "--once")
    assert (dev.returncode, place.reload_remedy in dev.stdout) == (reload.returncode, True), dev
    works("record", "stop", NODE)
    works("report", str(folder / "bag"), "--out", str(folder / "report.html"))
    assert (folder / "report.html").stat().st_size > 0
    assert "Traceback" not in executor.output
    executor.process.terminate()
    assert executor.process.wait(PATIENCE_S) == 0, executor.output


@pytest.mark.usefixtures("mounts")
@pytest.mark.parametrize("program", ["executor", "supervisor", "mauve"])
def test_a_full_shared_memory_is_refused_before_ros_ends_the_process(program: str, tmp_path: Path) -> None:
    """LTTng, which rcl loads, writes there: SIGBUS."""
    wrapper = _wrapper(Place(_all("size=64k", FULL, "/dev/shm")), tmp_path)  # noqa: S108
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    words = {
        "executor": ["lib/mauve_rt/executor", "--ros-args", "-p", f"architecture:={tmp_path}/robot.yaml"],
        "supervisor": ["lib/mauve_rt/supervisor", "--ros-args", "-p", f"rules:={tmp_path}/robot.yaml"],
        "mauve": ["bin/mauve", "nodes"],
    }[program]
    done = subprocess.run(
        [*wrapper, PREFIX / words[0], *words[1:]],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    (line,) = done.stderr.splitlines()
    assert done.returncode == BAD_INPUT
    assert line.startswith(f"{program}: shared memory /dev/shm: expected 64 KiB free, found 0 KiB.")
    assert line.endswith("--shm-size=256m.")


@pytest.fixture
def group_without_realtime() -> Iterator[Path]:
    """A cgroup whose real-time budget is 0, as that of a container."""
    group = GROUPS / f"mauve_rt_test_{os.getpid()}"
    try:
        group.mkdir()
    except OSError as error:
        pytest.skip(f"no group can be made in {GROUPS}: {error.strerror}")
    try:
        if not (group / "cpu.rt_runtime_us").exists():
            pytest.skip("the kernel has no real-time budgets of groups (CONFIG_RT_GROUP_SCHED)")
        (group / "cpu.rt_runtime_us").write_text("0", "ascii")
        yield group
    finally:
        group.rmdir()


def test_a_group_without_realtime_has_a_remedy_of_its_own(
    group_without_realtime: Path, start_executor: Callable[..., Any]
) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root has the right to SCHED_FIFO for certain")
    architecture = share_folder("mauve_examples") / "architecture" / "metronome.yaml"
    join = f'echo $$ > {group_without_realtime}/tasks && exec "$@"'
    executor = start_executor("-p", f"architecture:={architecture}", wrapper=("sh", "-c", join, "sh"))
    executor.await_output("activated")
    executor.process.terminate()
    assert executor.process.wait(PATIENCE_S) == 0, executor.output
    (line,) = [line for line in executor.output.splitlines() if "no real time: SCHED_FIFO" in line]
    assert "the cgroup has no real-time CPU time" in line
    assert "--cpu-rt-runtime=950000" in line
    assert "rtprio" not in line
