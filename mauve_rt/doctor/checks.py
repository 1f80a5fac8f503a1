"""The table of checks, and how they are carried out: a check that fails or hangs is a finding."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from mauve_rt.doctor import installation, kernel, network, rights, storage
from mauve_rt.doctor.finding import Computer, Finding, warning
from mauve_rt.errors import exception_text

_LIMIT_S = 10.0


@dataclass(frozen=True)
class Check:
    """One line of the report at least."""

    name: str
    examine: Callable[[Computer], Iterator[Finding]]
    limit_s: float = _LIMIT_S


CHECKS = (
    Check("kernel", kernel.check_preemption),
    Check("real-time rights", rights.check_rights),
    Check("throttling", kernel.check_throttling),
    Check("isolated CPUs", kernel.check_isolated),
    Check("governor", kernel.check_governor),
    Check("clock source", kernel.check_clock_source),
    Check("virtual machine", kernel.check_virtual_machine),
    Check("steal", kernel.check_steal),
    Check("CPU quota", kernel.check_cpu_quota),
    Check("memory limit", kernel.check_memory_limit),
    Check("shared memory", storage.check_shared_memory),
    Check("disk", storage.check_disk),
    Check("leftovers", storage.check_leftovers),
    Check("ROS distribution", network.check_distribution),
    Check("middleware", network.check_middleware),
    Check("reach", network.check_reach),
    Check("discovery", network.check_discovery, limit_s=3 * network.EXCHANGE_S),
    Check("participants", network.check_participants),
    Check("executor processes", installation.check_executor_processes),
    Check("plug-in index", installation.check_plugin_index),
    Check("plug-in libraries", installation.check_plugin_libraries, limit_s=120.0),
    Check("one build", installation.check_one_build),
)


def examine(check: Check, computer: Computer) -> list[Finding]:
    """The findings of one check, with its name."""
    found: list[Finding] = []
    thread = threading.Thread(target=_examine, args=(check, computer, found), daemon=True)
    thread.start()
    thread.join(check.limit_s)
    if thread.is_alive():
        found = [
            warning(
                f"no answer within {check.limit_s:g} s",
                cost="this check does not know; an executor may wait here, too",
                remedy="run `mauve doctor` again while the computer has less load",
            )
        ]
    return [replace(finding, name=check.name) for finding in found]


def _examine(check: Check, computer: Computer, into: list[Finding]) -> None:
    try:
        into += check.examine(computer)
    except Exception as problem:  # noqa: BLE001 - what cannot be read is a finding
        into.append(
            warning(
                f"cannot examine: {exception_text(problem)}",
                cost="this check does not know",
                remedy="run `mauve doctor` as a user who may read the file",
            )
        )
