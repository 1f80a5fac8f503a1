"""The real-time rights of this shell: asked for as an executor asks for them."""

import resource
from collections.abc import Iterator, Sequence

from mauve_rt.doctor.finding import Computer, Finding, ok, warning

_PAGE = "docs/howto/realtime_rights.md"
_COST = "an executor started from this shell runs without this right"
_LIMITS = {"rtprio": (resource.RLIMIT_RTPRIO, ""), "memlock": (resource.RLIMIT_MEMLOCK, " bytes")}


def missing_rights() -> list[str]:
    """One line for each right that the system denies this process: right, effect, how to grant it.

    Asked for a component of the highest priority, which is never deployed.
    """
    from mauve_rt._kernel import (  # noqa: PLC0415 - takes its time to load
        TASK_SETTINGS,
        Architecture,
        Deployer,
        PluginRegistry,
    )
    from mauve_rt.parts.cores import Core  # noqa: PLC0415
    from mauve_rt.parts.fsms import Fsm  # noqa: PLC0415
    from mauve_rt.parts.shells import Shell  # noqa: PLC0415

    architecture = Architecture(PluginRegistry())
    architecture.add_component("trial", Shell, Core, Fsm, priority=TASK_SETTINGS["priority"].most)
    deployer = Deployer(architecture, trace=False)
    deployer.prepare_process()
    return list(deployer.realtime_status().missing)


def check_rights(_computer: Computer) -> Iterator[Finding]:
    """SCHED_FIFO, locked memory and /dev/cpu_dma_latency, with the limits of this shell."""
    yield from describe_rights(missing_rights(), limits())


def describe_rights(missing: Sequence[str], limits: str) -> Iterator[Finding]:
    """What is denied, in the words of the kernel of MAUVE RT."""
    if not missing:
        yield ok(f"all granted; limits: {limits}")
    for line in missing:
        yield warning(line, cost=_COST, remedy=_PAGE)


def limits() -> str:
    """The limits of this process that rights depend on."""
    return ", ".join(f"{name} {_limit(which)}{unit}" for name, (which, unit) in _LIMITS.items())


def _limit(which: int) -> str:
    limit, _ = resource.getrlimit(which)
    return "unlimited" if limit == resource.RLIM_INFINITY else str(limit)
