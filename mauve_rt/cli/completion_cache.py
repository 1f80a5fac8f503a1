"""Executors and their parts as they last answered, in a small file that a completion reads.

A shell waits for each completion, and a ROS node takes longer to discover the graph than a user waits. So
verbs and `completion_refresh` write this file, and completions read it. Each account has a file of its own
for each ROS domain and reach of discovery. The file is a help: no error of it reaches the user.
"""

import contextlib
import json
import os
import stat
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from mauve_rt.node.shared.domain import DOMAIN, domain_problem
from mauve_rt.node.shared.rtps_ports import discovery_sockets
from mauve_rt.unfinished import beside, discard

_FORMAT = 1
_MAX_BYTES = 1 << 20
_CURRENT_S = 5.0  # a younger answer needs no refresh
_KEPT_S = 60.0  # an executor is offered for so long after its last answer where its process cannot be checked
_REACH = (  # with _RANGE: how far discovery reaches, and by which middleware
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "RMW_IMPLEMENTATION",
    "ROS_DISCOVERY_SERVER",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
)
_RANGE, _NARROWEST = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
_TEMPORARY = "/tmp"  # noqa: S108 - the owner is checked
_VALUE_PORTS = (1, 2)  # READ and WRITE of mauve_msgs/msg/PortInfo


@dataclass(frozen=True, kw_only=True)
class CachedComponent:
    """The names of one component."""

    name: str
    alternatives: tuple[str, ...] = ()  # cores that may replace the present one
    ports: tuple[str, ...] = ()  # that read or write values
    properties: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CachedExecutor:
    """One executor, and when it was last found."""

    name: str
    seen_s: float  # time.time() when it was last found or answered
    listed_s: float = 0.0  # time.time() of its last list of components; 0: none yet
    sockets: tuple[str, ...] = ()  # inodes of all discovery sockets at that time; none: cannot be checked
    components: tuple[CachedComponent, ...] = ()
    resources: tuple[str, ...] = ()

    def is_believable(self, now_s: float, sockets: frozenset[str]) -> bool:
        """Whether its process is likely to run still; `sockets`: the discovery sockets of now."""
        age_s = now_s - self.seen_s
        if age_s < 0:
            return False
        if self.sockets:  # a process that ends, ends its socket; inodes do not return soon
            return age_s <= _CURRENT_S or sockets.issuperset(self.sockets)
        return age_s <= _KEPT_S


@dataclass(frozen=True, kw_only=True)
class CachedGraph:
    """All executors of a ROS domain that were found."""

    found_s: float = 0.0  # time.time() when all of them were last looked for; 0: never
    executors: Mapping[str, CachedExecutor] = field(default_factory=dict)

    def with_found(self, names: Iterable[str], sockets: Iterable[str], now_s: float) -> "CachedGraph":
        """With exactly these executors; lists of components that are known already stay."""
        known = {name: self.executors.get(name) or CachedExecutor(name=name, seen_s=now_s) for name in names}
        seen = {
            name: replace(each, seen_s=now_s, sockets=tuple(sorted(sockets))) for name, each in known.items()
        }
        return CachedGraph(found_s=now_s, executors=seen)

    def with_reply(self, name: str, reply: Any, sockets: Iterable[str], now_s: float) -> "CachedGraph":
        """With the names of a ListComponents reply."""
        executor = CachedExecutor(
            name=name,
            seen_s=now_s,
            listed_s=now_s,
            sockets=tuple(sorted(sockets)),
            components=tuple(_component(each) for each in reply.components),
            resources=tuple(resource.name for resource in reply.resources),
        )
        return replace(self, executors={**self.executors, name: executor})

    def is_current(self, now_s: float, executor: str = "") -> bool:
        """Whether the names of executors, or those of one executor's parts, need no refresh."""
        known = self.executors.get(executor)
        return 0 <= now_s - (self.found_s if known is None else known.listed_s) <= _CURRENT_S


@dataclass(frozen=True)
class Cache:
    """The file of this account for one ROS domain."""

    file: Path
    domain: int

    @classmethod
    def of_environment(cls) -> "Cache | None":
        """The one of ROS_DOMAIN_ID and its like; None where no folder is safe to write or the domain is none.

        Before a program narrows its discovery: the environment as the user's shell has it is the key.
        """
        folder = _folder()
        if folder is None or domain_problem():
            return None
        domain = int(os.environ.get(DOMAIN) or 0)
        words = [os.environ.get(_RANGE) or _NARROWEST, *(os.environ.get(name, "") for name in _REACH)]
        reach = zlib.crc32("\0".join(words).encode(errors="surrogateescape"))
        return cls(folder / f"domain_{domain}_{reach:08x}.json", domain)

    @property
    def lock(self) -> Path:
        """The file that a refresh holds locked."""
        return self.file.with_suffix(".lock")

    def read(self) -> CachedGraph:
        """What is known; nothing where the file is missing, damaged, or not of this account alone."""
        try:
            return _graph(json.loads(_own_text(self.file)))
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return CachedGraph()

    def write(self, graph: CachedGraph) -> None:
        """Replace the file in one step; where that is not possible, the file stays as it is."""
        content = {
            "format": _FORMAT,
            "found_s": graph.found_s,
            "executors": [asdict(executor) for executor in graph.executors.values()],
        }
        data = json.dumps(content).encode()
        new = beside(self.file)
        if len(data) > _MAX_BYTES:
            return
        with contextlib.suppress(OSError):
            try:
                with open_own(new, os.O_WRONLY | os.O_EXCL) as descriptor:
                    is_whole = os.write(descriptor, data) == len(data)  # not on a disk that is full
                if is_whole:
                    new.replace(self.file)
                else:
                    new.unlink()
            except OSError:
                discard(new)

    def note_found(self, names: Iterable[str], sockets: Iterable[str]) -> None:
        """Write that these executors are all that were found."""
        self.write(self.read().with_found(names, sockets, time.time()))

    def note_reply(self, executor: str, reply: Any, sockets: Iterable[str]) -> None:
        """Write what a ListComponents reply names."""
        self.write(self.read().with_reply(executor, reply, sockets, time.time()))

    def sockets(self) -> frozenset[str]:
        """The discovery sockets on this machine in the domain, by inode."""
        try:
            return frozenset(socket.inode for socket in discovery_sockets(self.domain))
        except (OSError, ValueError):
            return frozenset()


@contextlib.contextmanager
def open_own(path: Path, flags: int) -> Iterator[int]:
    """A descriptor of a file that this account alone may use; made where it is missing.

    Raises:
        OSError: it cannot be opened, or belongs to another account.
    """
    descriptor = os.open(path, flags | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        _check_own(descriptor)
        yield descriptor
    finally:
        os.close(descriptor)


def _check_own(descriptor: int) -> None:
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & 0o077:
        raise PermissionError("expected a regular file of this account alone")


def _own_text(path: Path) -> str:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        _check_own(descriptor)
        return file.read(_MAX_BYTES).decode()


def _folder() -> Path | None:
    """A folder that this account alone may use, made where it is missing."""
    user = os.geteuid()
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    candidates = [Path(runtime, "mauve")] if runtime and _owner(Path(runtime)) == user else []
    temporary = [given for given in (os.environ.get("TMPDIR"), _TEMPORARY) if given]
    candidates += [Path(parent, f"mauve_{user}") for parent in temporary]
    return next((folder for folder in candidates if _is_own(folder, user)), None)


def _owner(path: Path) -> int | None:
    try:
        return path.stat().st_uid
    except OSError:
        return None


def _is_own(folder: Path, user: int) -> bool:
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return False
    is_private = stat.S_ISDIR(found.st_mode) and found.st_uid == user and not found.st_mode & 0o077
    return is_private and os.access(folder, os.W_OK | os.X_OK)


def _component(told: Any) -> CachedComponent:
    return CachedComponent(
        name=told.name,
        alternatives=tuple(told.alternatives),
        ports=tuple(port.name for port in told.ports if port.kind in _VALUE_PORTS),
        properties=tuple(text.partition("=")[0] for text in told.properties),
    )


def _graph(content: Any) -> CachedGraph:
    """Checks each type: another version, or a disk, may have left anything."""
    if content["format"] != _FORMAT:
        raise ValueError("another format")
    executors = [_executor(each) for each in content["executors"]]
    return CachedGraph(found_s=float(content["found_s"]), executors={each.name: each for each in executors})


def _executor(found: Any) -> CachedExecutor:
    return CachedExecutor(
        name=_text(found["name"]),
        seen_s=float(found["seen_s"]),
        listed_s=float(found["listed_s"]),
        sockets=_texts(found["sockets"]),
        components=tuple(
            CachedComponent(
                name=_text(each["name"]),
                alternatives=_texts(each["alternatives"]),
                ports=_texts(each["ports"]),
                properties=_texts(each["properties"]),
            )
            for each in found["components"]
        ),
        resources=_texts(found["resources"]),
    )


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("expected a text")
    return value


def _texts(values: list[object]) -> tuple[str, ...]:
    return tuple(map(_text, values))
