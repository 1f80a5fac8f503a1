"""What is known of another executor, by what is heard of it. Without ROS, ns of any steady clock."""

from typing import Literal

PeerState = Literal["unheard", "there", "another_instance", "faulted", "gone"]
PEER_STATES: tuple[PeerState, ...] = (
    "unheard",
    "there",
    "another_instance",
    "faulted",
    "gone",
)
GONE_AFTER_NS = 3_000_000_000  # three of its /diagnostics


class Peer:
    """One executor: it is there as long as it was heard lately."""

    def __init__(self) -> None:
        self._heard_ns: int | None = None
        self._instance = self._first_instance = ""
        self._is_faulted = False
        self._is_lost = False

    def alive(self, now_ns: int) -> None:
        """Something of it was heard."""
        self._heard_ns = now_ns
        self._is_lost = False

    def tell(self, now_ns: int, instance_id: str, *, faulted: bool) -> None:
        """Its state was heard; `faulted`: a component of it is."""
        self.alive(now_ns)
        self._first_instance = self._first_instance or instance_id
        self._instance, self._is_faulted = instance_id, faulted

    def lost(self) -> None:
        """The middleware says that it is there no more, before its silence does."""
        self._is_lost = self._heard_ns is not None

    def state(self, now_ns: int) -> PeerState:
        """How it is."""
        if self._heard_ns is None:
            return "unheard"
        if self._is_lost or now_ns > self._heard_ns + GONE_AFTER_NS:
            return "gone"
        if self._is_faulted:
            return "faulted"
        return "another_instance" if self._instance != self._first_instance else "there"

    def due_ns(self) -> int | None:
        """When it will be gone if nothing is heard; None: that is no question now."""
        if self._heard_ns is None or self._is_lost:
            return None
        return self._heard_ns + GONE_AFTER_NS + 1


def executor_name(said: str) -> str:
    """The full name of an executor's node, of its namespace or full name."""
    name = f"/{said.strip('/')}"
    return name if name.endswith("/executor") else f"{name.rstrip('/')}/executor"
