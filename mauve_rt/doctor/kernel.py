"""Checks of the Linux kernel: preemption, throttling, CPUs, clocks, and what a host or cgroup takes away."""

import re
from collections.abc import Iterator
from pathlib import Path

from mauve_rt.analysis.obstacles import is_virtual, runtime_us
from mauve_rt.doctor.finding import Computer, Finding, error, ok, warning

_RIGHTS, _CPUS = "docs/howto/realtime_rights.md", "docs/howto/pin_and_isolate_cpus.md"
_CPU_FOLDER = "/sys/devices/system/cpu"
_CLOCK = "/sys/devices/system/clocksource/clocksource0/current_clocksource"
_SLOW_CLOCKS = ("hpet", "acpi_pm", "jiffies", "refined-jiffies", "pit")  # 1 us for each reading, or more
_USUAL_US = 950_000
_STEAL = 7  # column of /proc/stat; guest times after it are contained in user times
_NOTABLE_STEAL = 0.1  # percent
_LEAST_MEMORY = 512 << 20  # an executor with its plug-ins, locked, and what the rest of the group needs
_UNLIMITED = 1 << 60  # cgroup v1 writes a number near 2 ** 63 for no limit


def preemption(root: Path = Path("/")) -> str:
    """The kernel's kind of preemption, as `PREEMPT_RT` or `PREEMPT_DYNAMIC (full)`."""
    computer = Computer(root)
    if _text(computer, "/sys/kernel/realtime") == "1":
        return "PREEMPT_RT"
    built = re.search(r"PREEMPT\w*", _text(computer, "/proc/version"))
    chosen = re.search(r"\((\w+)\)", _text(computer, "/sys/kernel/debug/sched/preempt"))
    return (built[0] if built else "no preemption named") + (f" ({chosen[1]})" if chosen else "")


def check_preemption(computer: Computer) -> Iterator[Finding]:
    """The kernel, and whether it is one with PREEMPT_RT."""
    kernel = f"Linux {computer.text('/proc/sys/kernel/osrelease')}, {preemption(computer.root)}"
    if "PREEMPT_RT" in kernel:
        yield ok(kernel)
    else:
        yield warning(
            kernel,
            cost="under load a component seldom starts milliseconds late",
            remedy=f"install a kernel with PREEMPT_RT: {_RIGHTS}#a-kernel-with-preempt_rt",
        )


def check_throttling(computer: Computer) -> Iterator[Finding]:
    """The share of each second that real-time threads get."""
    runtime = runtime_us(computer.root)
    remedy = f"sudo sysctl kernel.sched_rt_runtime_us={_USUAL_US}"
    if runtime == 0:
        cost = "the kernel runs no thread of SCHED_FIFO"
        yield error("real-time threads get no CPU time", cost=cost, remedy=remedy)
    elif 0 < runtime < _USUAL_US:
        yield warning(
            f"real-time threads get {runtime / 1e3:g} ms of each second",
            cost="components stop for the rest of the second when they use more",
            remedy=remedy,
        )
    else:
        yield ok("off" if runtime < 0 else f"real-time threads get up to {runtime / 1e3:g} ms of each second")


def check_isolated(computer: Computer) -> Iterator[Finding]:
    """CPUs that the scheduler gives to no other program."""
    online = computer.text(f"{_CPU_FOLDER}/online")
    isolated = computer.text(f"{_CPU_FOLDER}/isolated")
    if isolated:
        yield ok(f"{isolated} of {online}")
    else:
        yield warning(
            f"none of {online}",
            cost="interrupts and other programs run on the CPUs of components, and delay them",
            remedy=f"{_CPUS}#3-keep-other-work-away-from-two-cpus",
        )


def check_governor(computer: Computer) -> Iterator[Finding]:
    """Whether the clock rate of a CPU sinks when the CPU is idle."""
    files = sorted(computer.path(_CPU_FOLDER).glob("cpu[0-9]*/cpufreq/scaling_governor"))
    found: dict[str, list[str]] = {}
    for file in files:
        found.setdefault(file.read_text("ascii").strip(), []).append(file.parents[1].name)
    text = ", ".join(f"{name} ({', '.join(cpus)})" for name, cpus in found.items())
    if found.keys() - {"performance"}:
        yield warning(
            text,
            cost="an idle CPU slows down: a component that wakes there starts and executes later",
            remedy="sudo cpupower frequency-set --governor performance",
        )
    else:
        yield ok(text or "the kernel does not change the clock rate")


def check_clock_source(computer: Computer) -> Iterator[Finding]:
    """How the kernel reads the time."""
    source = computer.text(_CLOCK)
    if source in _SLOW_CLOCKS:
        yield warning(
            source,
            cost="each reading of the clock takes about 1 us, and an activation has at least two",
            remedy="add clocksource=tsc tsc=reliable to the kernel's command line, if the TSC is stable",
        )
    else:
        yield ok(source)


def check_virtual_machine(computer: Computer) -> Iterator[Finding]:
    """Whether a host can take the CPUs away."""
    if is_virtual(computer.root):
        yield warning(
            "a virtual machine",
            cost="the host may stop a CPU at any time: no measurement here proves a latency",
            remedy="run the robot on a computer of its own",
        )
    else:
        yield ok("no virtual machine")


def check_steal(computer: Computer) -> Iterator[Finding]:
    """CPU time that a host gave to others since the start."""
    spent = [int(word) for word in computer.text("/proc/stat").splitlines()[0].split()[1 : _STEAL + 2]]
    percent = 100 * spent[_STEAL] / max(1, sum(spent)) if len(spent) > _STEAL else 0.0
    text = f"the host took {percent:.2g} % of the CPU time since the start"
    if percent > _NOTABLE_STEAL:
        cost = "components of all priorities stood still for this time"
        yield warning(
            text,
            cost=cost,
            remedy="give the virtual machine CPUs of its own, or use a computer without a host",
        )
    else:
        yield ok(text)


def check_cpu_quota(computer: Computer) -> Iterator[Finding]:
    """A limit on CPU time, of this shell's cgroup or of a group around it."""
    limits = [f"{used} us of each {period} us ({file})" for file, used, period in _quotas(computer)]
    if limits:
        yield warning(
            f"limited to {'; '.join(limits)}",
            cost="when the quota is used up, all threads of the group stop until the next period",
            remedy="remove CPUQuota= from the unit, or --cpus from the container's command line",
        )
    elif any(_text(computer, f"{folder}/cpu.rt_runtime_us") == "0" for folder in _folders(computer, "cpu")):
        yield error(
            "the cgroup of this shell has no real-time CPU time (cpu.rt_runtime_us is 0)",
            cost="the kernel refuses SCHED_FIFO to all programs of the group",
            remedy="add --cpu-rt-runtime=950000 to the container's command line, or leave the group",
        )
    else:
        yield ok("no limit")


def check_memory_limit(computer: Computer) -> Iterator[Finding]:
    """The least memory limit of this shell's cgroup and the groups around it."""
    limits = {}
    for controller, file in (("", "memory.max"), ("memory", "memory.limit_in_bytes")):
        for folder in _folders(computer, controller):
            text = _text(computer, f"{folder}/{file}")
            if text.isdigit() and int(text) < _UNLIMITED:
                limits[f"{folder}/{file}"] = int(text)
    if not limits:
        yield ok("no limit")
        return
    file, least = min(limits.items(), key=lambda each: each[1])
    text = f"{least / (1 << 20):,.0f} MiB ({file})"
    if least >= _LEAST_MEMORY:
        yield ok(text)
    else:
        yield warning(
            text,
            cost="an executor keeps all its memory locked: at the limit the kernel ends a program",
            remedy=f"allow at least {_LEAST_MEMORY >> 20} MiB: MemoryMax= of a unit, --memory of a container",
        )


def _quotas(computer: Computer) -> Iterator[tuple[str, str, str]]:
    """(file, us, period in us) of each group that has a quota."""
    for folder in _folders(computer, ""):
        used, _, period = _text(computer, f"{folder}/cpu.max").partition(" ")
        if used.isdigit():
            yield f"{folder}/cpu.max", used, period
    for folder in _folders(computer, "cpu"):
        used = _text(computer, f"{folder}/cpu.cfs_quota_us")
        if used.isdigit():
            yield f"{folder}/cpu.cfs_quota_us", used, _text(computer, f"{folder}/cpu.cfs_period_us")


def _folders(computer: Computer, controller: str) -> Iterator[str]:
    """The cgroup of this process and those around it; `controller`: of version 1, empty: of version 2."""
    for line in _text(computer, "/proc/self/cgroup").splitlines():
        _, controllers, path = line.split(":", 2)
        if controller not in controllers.split(","):
            continue
        base = "/".join(filter(None, ("/sys/fs/cgroup", controller)))
        names = [name for name in path.split("/") if name]
        for count in range(len(names), -1, -1):
            folder = "/".join((base, *names[:count]))
            if computer.path(folder).is_dir():
                yield folder


def _text(computer: Computer, path: str) -> str:
    try:
        return computer.text(path)
    except OSError:
        return ""
