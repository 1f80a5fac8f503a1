"""Machines made of Linux namespaces, joined by cables to one switch; their links can be cut for real.

Each has network interfaces of its own, and a /dev/shm: what runs on two of them shares nothing but the cable
and the files. They are gone when their last process is. Needs the right to make namespaces (root), and `ip`.
"""

import contextlib
import ctypes
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

ADDRESS, GROUND_ADDRESS = "10.77.0.", "10.77.{}."
_NEW_NETWORK = 0x40000000  # CLONE_NEWNET of linux/sched.h
_HOLD = ("unshare", "--net", "--mount", "--ipc", "sh", "-c")
_BEGIN = "mount -t tmpfs none /dev/shm && ip link set lo up && echo ready && exec cat"


class HostsError(Exception):
    """Such machines cannot be made here; says why."""


class Machine:
    """One of them: namespaces held by a process that ends with this one."""

    def __init__(self) -> None:
        """Make it, without a cable.

        Raises:
            HostsError: a right or a program is missing.
        """
        missing = [name for name in ("ip", "unshare", "nsenter") if shutil.which(name) is None]
        if missing:
            raise HostsError(f"needs the program `{missing[0]}`, of iproute2 and util-linux")
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        self._holder = subprocess.Popen([*_HOLD, _BEGIN], text=True, start_new_session=True, **pipes)  # type: ignore[call-overload]
        if self._holder.stdout.readline() != "ready\n":
            said = self._holder.communicate()[1].strip()
            raise HostsError(f"needs the right to make network namespaces (root): {said}")

    @property
    def pid(self) -> int:
        """Of the process that holds the namespaces."""
        return int(self._holder.pid)

    @property
    def wrapper(self) -> list[str]:
        """What goes before a command line to run it there."""
        enter = ["nsenter", f"--target={self.pid}", "--net", "--mount", "--ipc"]
        stay = ["sh", "-c", 'cd "$0" && exec "$@"', str(Path.cwd())]  # who enters is in the root folder
        return [*enter, *stay]

    def run(self, *words: str) -> None:
        """Run a command there, to its end.

        Raises:
            HostsError: it failed.
        """
        _run(*self.wrapper, *words)

    def close(self) -> None:
        """Let go of the namespaces."""
        self._holder.communicate()


class Hosts:
    """Machines on one switch, by name. For one thread."""

    def __init__(self, names: Sequence[str]) -> None:
        """Make them, all connected.

        Raises:
            HostsError: a right or a program is missing; nothing is left of it.
        """
        self._machines: dict[str, Machine] = {}
        self._switch = Machine()
        try:
            self._switch.run("ip", "link", "add", "switch", "type", "bridge", "mcast_snooping", "0")
            self._switch.run("ip", "link", "set", "switch", "up")
            for number, name in enumerate(names, start=1):
                self._machines[name] = machine = Machine()
                self._connect(machine, number)
        except BaseException:
            self.close()
            raise

    def wrapper(self, name: str) -> list[str]:
        """What goes before a command line to run it on a machine."""
        return self._machines[name].wrapper

    def set_link(self, name: str, *, up: bool) -> None:
        """Plug a machine's cable in, or pull it out: it sees no carrier then."""
        port = f"port{list(self._machines).index(name) + 1}"
        self._switch.run("ip", "link", "set", port, "up" if up else "down")

    def set_loss(self, name: str, percent: int) -> None:
        """Let a machine lose a share of the packets that come by its cable, at random; 0: none.

        Raises:
            HostsError: nftables is not there.
        """
        machine = self._machines[name]
        if shutil.which("nft") is None:
            raise HostsError("needs the program `nft`, of nftables")
        with contextlib.suppress(HostsError):
            machine.run("nft", "delete", "table", "inet", "loss")
        if percent:
            rule = f"iifname cable numgen random mod 100 < {percent} drop"
            table = f"table inet loss {{ chain input {{ type filter hook input priority 0; {rule}; }}; }}"
            machine.run("nft", table)

    def take_off_switch(self) -> tuple[list[str], list[str]]:
        """Leave it to a program of the caller's to carry frames between the machines' cables.

        Returns:
            What goes before its command line, and the names of the cables' other ends.

        Raises:
            HostsError: the kernel refuses.

        """
        ports = [f"port{number}" for number in range(1, len(self._machines) + 1)]
        for port in ports:
            self._switch.run("ip", "link", "set", port, "nomaster")
        return self._switch.wrapper, ports

    def connect_ground(self) -> None:
        """Move this process into a network of its own, with a cable to each machine that stays plugged in.

        Before it has threads. What goes by one of these cables does not reach the others.

        Raises:
            HostsError: the kernel refuses.
        """
        if ctypes.CDLL(None, use_errno=True).unshare(_NEW_NETWORK):
            raise HostsError(f"no network of its own: {os.strerror(ctypes.get_errno())}")
        _run("ip", "link", "set", "lo", "up")
        _forward_nothing()
        for number, machine in enumerate(self._machines.values(), start=1):
            ends = ("type", "veth", "peer", "name", "ground", "netns", str(machine.pid))
            address = GROUND_ADDRESS.format(number)
            _run("ip", "link", "add", f"ground{number}", *ends)
            _run("ip", "addr", "add", f"{address}1/24", "dev", f"ground{number}")
            _run("ip", "link", "set", f"ground{number}", "up")
            machine.run("ip", "addr", "add", f"{address}2/24", "dev", "ground")
            machine.run("ip", "link", "set", "ground", "up")

    def close(self) -> None:
        """Let go of all; the processes there are the caller's to end."""
        for machine in (*self._machines.values(), self._switch):
            machine.close()
        self._machines.clear()

    def _connect(self, machine: Machine, number: int) -> None:
        port = f"port{number}"
        ends = ("netns", str(machine.pid), "type", "veth", "peer", "name", port)
        self._switch.run("ip", "link", "add", "cable", *ends)
        self._switch.run("ip", "link", "set", port, "master", "switch", "up")
        machine.run("ip", "addr", "add", f"{ADDRESS}{number}/24", "dev", "cable")
        machine.run("ip", "link", "set", "cable", "up")


def _forward_nothing() -> None:
    forward = Path("/proc/sys/net/ipv4/ip_forward")  # of the network of who opens it
    try:
        if forward.read_text("ascii").strip() != "0":
            forward.write_text("0", encoding="ascii")
    except OSError as error:
        raise HostsError(f"the machines would reach each other by this one: {error}") from None


def _run(*words: str) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise HostsError(f"{' '.join(words)}: {done.stderr.strip()}")
