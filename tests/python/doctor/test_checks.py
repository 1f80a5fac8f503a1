"""The checks of `mauve doctor` on trees of files: of a computer that suits, and of one that does not."""

import fcntl
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from compiled_plugins import link

from mauve_rt import _kernel
from mauve_rt.doctor import installation, kernel, network, rights, storage
from mauve_rt.doctor.checks import CHECKS, Check, examine
from mauve_rt.doctor.finding import Computer, Finding, Status
from mauve_rt.native_program import native_prefix

SHARED, TEMPORARY = "/dev/shm", "/tmp"  # noqa: S108 - of a tree, or Fast DDS's
Examine = Callable[[Computer], Iterator[Finding]]
SUITED = {
    "/proc/sys/kernel/osrelease": "6.12.5-rt\n",
    "/proc/version": "Linux version 6.12.5-rt (gcc) #1 SMP PREEMPT_RT Mon\n",
    "/proc/sys/kernel/sched_rt_runtime_us": "950000\n",
    "/proc/cpuinfo": "flags\t\t: fpu vme tsc\n",
    "/proc/stat": "cpu  100 0 100 10000 0 0 0 0 0 0\ncpu0 100 0 100 10000 0 0 0 0 0 0\n",
    "/proc/self/cgroup": "0::/user.slice\n",
    "/proc/net/udp": "  sl  local_address rem_address\n",
    "/sys/fs/cgroup/user.slice/cpu.max": "max 100000\n",
    "/sys/fs/cgroup/user.slice/memory.max": "max\n",
    "/sys/devices/system/cpu/online": "0-3\n",
    "/sys/devices/system/cpu/isolated": "2-3\n",
    "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "performance\n",
    "/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor": "performance\n",
    "/sys/devices/system/clocksource/clocksource0/current_clocksource": "tsc\n",
    f"{SHARED}/keep": "",
    f"{TEMPORARY}/keep": "",
}
V1 = {
    "/proc/self/cgroup": "5:cpu,cpuacct:/robot\n4:memory:/robot\n",
    "/sys/fs/cgroup/cpu/robot/cpu.cfs_quota_us": "50000\n",
    "/sys/fs/cgroup/cpu/robot/cpu.cfs_period_us": "100000\n",
    "/sys/fs/cgroup/memory/robot/memory.limit_in_bytes": "104857600\n",
}
# The check, the files that differ, the status, words of what is found.
UNSUITED: tuple[tuple[Examine, Mapping[str, str], Status, str], ...] = (
    (
        kernel.check_preemption,
        {"/proc/version": "Linux version 6.8.0 #1 SMP PREEMPT_DYNAMIC Mon\n"},
        Status.WARNING,
        "PREEMPT_DYNAMIC",
    ),
    (kernel.check_throttling, {"/proc/sys/kernel/sched_rt_runtime_us": "100000\n"}, Status.WARNING, "100 ms"),
    (kernel.check_throttling, {"/proc/sys/kernel/sched_rt_runtime_us": "0\n"}, Status.ERROR, "no CPU time"),
    (kernel.check_isolated, {"/sys/devices/system/cpu/isolated": "\n"}, Status.WARNING, "none of 0-3"),
    (
        kernel.check_governor,
        {"/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor": "powersave\n"},
        Status.WARNING,
        "powersave (cpu1)",
    ),
    (
        kernel.check_clock_source,
        {"/sys/devices/system/clocksource/clocksource0/current_clocksource": "hpet\n"},
        Status.WARNING,
        "hpet",
    ),
    (kernel.check_virtual_machine, {"/proc/cpuinfo": "flags : hypervisor\n"}, Status.WARNING, "virtual"),
    (kernel.check_steal, {"/proc/stat": "cpu  100 0 100 700 0 0 0 100 0 0\n"}, Status.WARNING, "took 10 %"),
    (
        kernel.check_cpu_quota,
        {"/sys/fs/cgroup/user.slice/cpu.max": "50000 100000\n"},
        Status.WARNING,
        "50000 us of each 100000 us (/sys/fs/cgroup/user.slice/cpu.max)",
    ),
    (kernel.check_cpu_quota, V1, Status.WARNING, "50000 us of each 100000 us"),
    (
        kernel.check_cpu_quota,
        {"/proc/self/cgroup": "5:cpu:/robot\n", "/sys/fs/cgroup/cpu/robot/cpu.rt_runtime_us": "0\n"},
        Status.ERROR,
        "cpu.rt_runtime_us is 0",
    ),
    (
        kernel.check_memory_limit,
        {"/sys/fs/cgroup/memory.max": "209715200\n"},  # of the group around
        Status.WARNING,
        "200 MiB (/sys/fs/cgroup/memory.max)",
    ),
    (kernel.check_memory_limit, V1, Status.WARNING, "100 MiB"),
)
OF_TREES = tuple(dict.fromkeys(examine for examine, *_ in UNSUITED))


def tree(folder: Path, **files: str) -> Computer:
    """A computer of these files."""
    for name, text in (SUITED | files).items():
        file = folder / name.removeprefix("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return Computer(folder)


@pytest.mark.parametrize("check", OF_TREES)
def test_a_computer_that_suits_is_ok(check: Examine, tmp_path: Path) -> None:
    assert [finding.status for finding in check(tree(tmp_path))] == [Status.OK]


@pytest.mark.parametrize(("check", "files", "status", "words"), UNSUITED)
def test_what_does_not_suit_has_its_cost_and_its_remedy(
    check: Examine, files: Mapping[str, str], status: Status, words: str, tmp_path: Path
) -> None:
    [finding] = check(tree(tmp_path, **files))
    assert finding.status == status
    assert words in finding.found
    assert finding.cost
    assert finding.remedy


def test_what_cannot_be_read_is_a_finding(tmp_path: Path) -> None:
    for check in CHECKS:
        if check.examine in OF_TREES:
            for finding in examine(check, Computer(tmp_path / "empty")):
                assert finding.name == check.name
                assert finding.status in (Status.OK, Status.WARNING)
    [finding] = examine(Check("steal", kernel.check_steal), Computer(tmp_path / "empty"))
    assert (finding.status, "/proc/stat" in finding.found) == (Status.WARNING, True)


def test_a_check_that_hangs_is_a_finding(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "stuck")  # a reader waits for a writer

    def stuck(computer: Computer) -> Iterator[Finding]:
        computer.text("/stuck")
        yield from ()

    [finding] = examine(Check("stuck", stuck, limit_s=0.2), Computer(tmp_path))
    assert finding.found == "no answer within 0.2 s"
    with (tmp_path / "stuck").open("w"):
        pass  # lets the thread end


def test_each_remedy_that_names_a_page_names_one_that_exists() -> None:
    root = Path(__file__).parents[3]
    sources = (Path(kernel.__file__).parent).glob("*.py")
    text = "".join(file.read_text(encoding="utf-8") for file in sources)
    pages = set(re.findall(r"docs/[\w/]+\.md", text))
    assert len(pages) > 4
    assert [page for page in pages if not (root / page).is_file()] == []


def test_rights_have_the_words_of_the_kernel_and_the_limits() -> None:
    denied = rights.missing_rights()
    found = list(rights.describe_rights(denied, rights.limits()))
    if denied:  # without rights, as in most containers
        assert [each.found for each in found] == denied
        assert all(each.status == Status.WARNING and each.remedy for each in found)
        assert not any("priority 1 " in each.found for each in found)  # a low limit is not enough
    [granted] = rights.describe_rights([], rights.limits())
    assert granted.status == Status.OK
    assert re.search(r"rtprio (\d+|unlimited), memlock (\d+|unlimited)", granted.found)
    [one] = rights.describe_rights(["SCHED_FIFO"], "")
    assert (one.status, one.found) == (Status.WARNING, "SCHED_FIFO")


def test_shared_memory_that_is_missing_is_an_error(tmp_path: Path) -> None:
    [there] = storage.check_shared_memory(tree(tmp_path / "there"))
    assert SHARED in there.found
    [missing] = storage.check_shared_memory(Computer(tmp_path))
    assert (missing.status, missing.found) == (Status.ERROR, f"{SHARED} is missing")


def test_little_room_is_a_warning() -> None:
    assert storage.room("/a", 2 << 20, least=1 << 20).status == Status.OK
    little = storage.room("/a", 1 << 20, least=2 << 20)
    assert (little.status, little.found) == (Status.WARNING, "1 MiB free in /a")
    assert storage.room("/a", 0, least=1).status == Status.ERROR
    [finding] = storage.check_disk(Computer())
    assert str(Path.cwd()) in finding.found


def test_only_segments_of_the_dead_are_leftovers(tmp_path: Path) -> None:
    computer = tree(tmp_path)
    memory = tmp_path / "dev" / "shm"
    for name in ("fastrtps_dead", "fastrtps_dead_el", "fastrtps_live", "fastrtps_live_el"):
        (memory / name).write_bytes(b"x" * 4096)
    (tmp_path / "tmp" / "mauve_4_0123456789abcdef.xml").touch()  # no process 4 in this tree
    (tmp_path / "tmp" / "mauve_5_0123456789abcdef.xml").touch()
    (tmp_path / "proc" / "5").mkdir()
    with (memory / "fastrtps_live_el").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        [finding] = storage.check_leftovers(computer)
    assert finding.status == Status.WARNING
    assert finding.found.startswith("3 files of dead processes")
    assert finding.remedy == "rm " + " ".join(
        str(tmp_path / name)
        for name in ("dev/shm/fastrtps_dead", "dev/shm/fastrtps_dead_el", "tmp/mauve_4_0123456789abcdef.xml")
    )
    for name in ("dev/shm/fastrtps_dead", "dev/shm/fastrtps_dead_el", "tmp/mauve_4_0123456789abcdef.xml"):
        (tmp_path / name).unlink()
    (memory / "fastrtps_live_el").unlink()
    assert [each.found for each in storage.check_leftovers(computer)] == ["none"]


_PARTICIPANT = """\
import rclpy, time
rclpy.init()
node = rclpy.create_node("victim")
print("ready", flush=True)
time.sleep(600)
"""


def test_the_shared_memory_of_a_killed_participant_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As Fast DDS leaves it."""
    memory = Path(SHARED)
    environment = os.environ | {"ROS_DOMAIN_ID": "50", "ROS_LOG_DIR": str(tmp_path)}
    before = {file.name for file in memory.iterdir()}
    process = subprocess.Popen(
        [sys.executable, "-c", _PARTICIPANT], env=environment, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        new = [file for file in memory.glob("fastrtps_*_el") if file.name not in before]
        live, _ = storage._dead_segments(memory)
        assert new, "Fast DDS uses shared memory"
        mine = [file for file in new if _is_held_by(file, process.pid)]
        assert mine
        assert not set(mine) & set(live)
    finally:
        process.kill()
        process.wait()
    try:
        dead, _ = storage._dead_segments(memory)
        assert set(mine) <= set(dead)
    finally:
        for file in mine:
            file.unlink(missing_ok=True)
            file.with_name(file.name.removesuffix("_el")).unlink(missing_ok=True)


def _is_held_by(file: Path, process: int) -> bool:
    return any(link.resolve() == file for link in Path(f"/proc/{process}/fd").iterdir())


def test_participants_are_counted_by_domain(tmp_path: Path) -> None:
    row = "  1: 0100007F:{:04X} 00000000:0000 07 0 0 0 0 0 99 2 0 0"
    ports = (7400, 7410, 7411, 7412, 7400 + 250 * 3 + 10, 60000)  # multicast, two, data of one, domain 3, any
    text = "\n".join(["  sl  local", *map(row.format, ports)]) + "\n"
    [finding] = network.check_participants(tree(tmp_path, **{"/proc/net/udp": text}))
    assert "2 participants in domain 0" in finding.found
    assert "1 participant in domain 3" in finding.found
    [none] = network.check_participants(tree(tmp_path / "none"))
    assert none.found == "no participant"


def test_reach_of_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    assert _only(network.check_reach) == (Status.OK, "this computer only, ROS_DOMAIN_ID 0", "")
    for value, status, words in (
        ("SUBNET", Status.WARNING, "open to other computers (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET)"),
        ("OFF", Status.WARNING, "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF"),
    ):
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", value)
        assert _only(network.check_reach)[:2] == (status, words)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_STATIC_PEERS", "10.0.0.2")
    status, found, remedy = _only(network.check_reach)
    assert (status, "ROS_STATIC_PEERS=10.0.0.2" in found) == (Status.WARNING, True)
    assert remedy.startswith("unset ROS_AUTOMATIC_DISCOVERY_RANGE ROS_STATIC_PEERS,")
    monkeypatch.delenv("ROS_STATIC_PEERS")
    monkeypatch.setenv("ROS_DOMAIN_ID", "900")
    assert _only(network.check_reach)[0] == Status.ERROR
    monkeypatch.setenv("ROS_DOMAIN_ID", "1")
    profile = tmp_path / "profile.xml"
    profile.write_text("<profiles/>", encoding="utf-8")
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))
    own, waits = network.check_reach(Computer())
    assert (own.status, str(profile) in own.found) == (Status.WARNING, True)
    assert "non_blocking_send" in waits.found


def test_middleware_and_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.delenv("RMW_IMPLEMENTATION", raising=False)
    assert _only(network.check_middleware)[0] == Status.OK
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    status, found, _ = _only(network.check_middleware)
    assert (status, "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in found) == (Status.ERROR, True)
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    assert _only(network.check_distribution)[0] == Status.OK
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert _only(network.check_distribution)[:2] == (Status.ERROR, "ROS_DISTRO=humble")


def test_a_line_of_the_index_that_names_a_missing_library(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert _only(installation.check_plugin_index)[0] == Status.OK
    index = tmp_path / "share/ament_index/resource_index/mauve_rt_plugins"
    index.mkdir(parents=True)
    (index / "lost").write_text("shell; lost/Shell; ; lost\nwrong line\n", encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}")
    complaint, missing = installation.check_plugin_index(Computer())
    assert (complaint.status, f"{index / 'lost'}:2:1" in complaint.found) == (Status.WARNING, True)
    assert missing.status == Status.ERROR
    assert (
        missing.found == f"{tmp_path / 'lib/liblost.so'} is missing; the index lists shell lost/Shell of it"
    )


def test_a_library_that_does_not_load_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert _only(installation.check_plugin_libraries)[0] == Status.OK
    index = tmp_path / "share/ament_index/resource_index/mauve_rt_plugins"
    index.mkdir(parents=True)
    (index / "torn").write_text("shell; torn/Shell; ; torn\n", encoding="utf-8")
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libtorn.so").write_bytes(b"\x7fELF of a copy that ended early")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}")
    status, found, remedy = _only(installation.check_plugin_libraries)
    assert (status, "libtorn.so" in found) == (Status.ERROR, True)
    assert "build its package again" in remedy


def test_a_library_of_another_version_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    index = tmp_path / "share/ament_index/resource_index/mauve_rt_plugins"
    index.mkdir(parents=True)
    (index / "old").write_text("shell; old/Shell; ; old\n", encoding="utf-8")
    (tmp_path / "lib").mkdir()
    source = tmp_path / "old.cpp"
    source.write_text('extern "C" void mauve_register_plugins(void*) {}\n', encoding="utf-8")
    link([source], tmp_path / "lib" / "libold.so", "-fPIC")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}")
    status, found, _ = _only(installation.check_plugin_libraries)
    assert (status, "built against another version of MAUVE RT" in found) == (Status.ERROR, True), found


def test_parts_of_two_builds_are_named(tmp_path: Path) -> None:
    prefix = native_prefix()
    assert _only(installation.check_one_build)[0] == Status.OK

    def described(*versions: str, at: Path = prefix, **places: Path | None) -> list[tuple[Status, str]]:
        found = installation.describe_build(at, versions=(versions[0], versions[1]), places=dict(places))
        return [(each.status, each.found) for each in found]

    assert described("1", "1", sources=prefix, mauve=None) == [(Status.OK, f"version 1 in {prefix}")]
    [(status, found)] = described("1", "2")
    assert (status, "version 1, native modules of version 2" in found) == (Status.ERROR, True)
    [(status, found)] = described("1", "1", mauve=tmp_path)
    assert (status, found) == (Status.WARNING, f"mauve: of {tmp_path}, the native modules of {prefix}")
    [(status, found)] = described("1", "1", at=tmp_path)
    assert (status, found) == (Status.ERROR, f"no executor in {tmp_path}/lib/mauve_rt/executor")


def test_executors_of_another_build_are_named(tmp_path: Path) -> None:
    own = Path(_kernel.__file__).resolve()

    def process(number: int, kernel_file: str, program: str = "/a/lib/mauve_rt/executor") -> dict[str, str]:
        folder = f"/proc/{number}"
        return {
            f"{folder}/cmdline": f"python3\0{program}\0--ros-args\0",
            f"{folder}/environ": f"HOME=/\0ROS_DOMAIN_ID={number}\0",
            f"{folder}/maps": f"7f00-7f01 r-xp 00000000 08:01 9    {kernel_file}\n",
        }

    files = process(21, str(own)) | process(22, "/usr/bin/cat", program="/a/bin/cat")
    [found] = installation.check_executor_processes(tree(tmp_path / "one", **files))
    assert (found.status, found.found) == (Status.OK, "process 21 in domain 21")
    files = process(23, f"{own} (deleted)") | process(24, "/old/mauve_rt/_kernel.so")
    *others, rest = installation.check_executor_processes(tree(tmp_path / "two", **files))
    assert [(each.status, each.found.split(" runs ")[0]) for each in others] == [
        (Status.WARNING, "process 23 in domain 23"),
        (Status.WARNING, "process 24 in domain 24"),
    ]
    assert rest.found == "none of this build runs"


def _only(check: Examine) -> tuple[Status, str, str]:
    [finding] = check(Computer())
    return finding.status, finding.found, finding.remedy
