"""A short-lived ROS node that asks an executor."""

import signal
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext
from types import FrameType
from typing import Any

from rclpy.qos import QoSProfile
from rosidl_generator_py.import_type_support_impl import UnsupportedTypeSupport

from mauve_rt.cli.completion_cache import Cache
from mauve_rt.cli.discovery import ANNOUNCED_S, Discovery, Participant
from mauve_rt.cli.exchange import Exchange
from mauve_rt.cli.transport import accounts_in_the_way, by_fast_dds, by_udp
from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.discovery import limit_discovery, stays_on_this_machine
from mauve_rt.node.shared.domain import domain_problem
from mauve_rt.node.shared.static_peers import resolve_static_peers, unresolved_text

DISCOVERY_TIMEOUT_S = 10.0  # for a service that is being started, or on another machine
STARTING_S = 3.0  # where there is no executor at all, one may be starting
OTHERS_S = 1.0  # where there are others: the names of a node may come after its participant
REPLY_TIMEOUT_S = 15.0  # longer than any time-out that a request can ask for
RESEND_S = 4.0
_LIST_SERVICE, _LIST = "mauve_msgs/srv/ListComponents", "/list_components"
_POLL_S = 0.05  # waiting in rclpy does not end at a Ctrl-C: short waits do
_LOOK_S = 0.01  # between two looks at what is discovered
_interrupted = threading.Event()


class NoExecutorError(ParameterError):
    """Nobody answers under the given name."""


class Client:
    """Asks executors, and writes the names that they answer for completions. For one thread."""

    def __init__(self, discovery: Discovery, cache: Cache | None = None) -> None:
        self._discovery = discovery
        self._known: dict[str, tuple[Participant, Any]] = {}  # by service: who is asked again
        self._cache = cache
        self._list_clients: dict[tuple[str, int], Any] = {}  # of `ask_for_list`

    def call(self, service_type: Any, service: str, request: Any, *, wait_s: float = 0.0) -> Any:
        """The reply of a service, e.g. `/robot_1/executor/stop`.

        A reply can be lost while the service does not know its new client yet: the request is sent again. An
        executor knows it by its id, and gives the first outcome.

        Args:
            service_type: its class.
            service: its full name.
            request: a message.
            wait_s: how long to wait for a service that may be about to be there, whatever else there is.

        Raises:
            NoExecutorError: all that is there is known and has no such service, or there is no reply in 15 s.
        """
        participant, client = self._known.get(service) or self._found(service_type, service, wait_s)
        if not client.service_is_ready():
            participant, client = self._found(service_type, service, wait_s)
        self._known[service] = participant, client
        if getattr(request, "request_id", None) == "":
            request.request_id = str(uuid.uuid4())
        futures: list[Any] = []
        deadline = time.monotonic() + REPLY_TIMEOUT_S
        while (now := time.monotonic()) < deadline:
            if now >= deadline - REPLY_TIMEOUT_S + len(futures) * RESEND_S:
                futures.append(client.call_async(request))
            _spin_once(participant)
            for future in futures:
                if future.done():
                    reply = future.result()
                    if service.endswith(_LIST):
                        self.note_list(service.removesuffix(_LIST), reply)
                    return reply
        raise NoExecutorError(self._unanswered(service))

    def _found(self, service_type: Any, service: str, wait_s: float) -> tuple[Participant, Any]:
        """The first participant of ours that knows the service, and a client of it."""
        clients: list[Any] = []
        begun_s = time.monotonic()
        while True:
            newer = self._discovery.participants[len(clients) :]
            clients += [participant.node.create_client(service_type, service) for participant in newer]
            for participant, client in zip(self._discovery.participants, clients, strict=True):
                if client.service_is_ready():
                    return participant, client
            waited_s = time.monotonic() - begun_s
            if waited_s >= DISCOVERY_TIMEOUT_S or (
                waited_s >= wait_s and self._is_hopeless(service, waited_s)
            ):
                raise NoExecutorError(self._missing(service))
            self._look_again()

    def _is_hopeless(self, service: str, waited_s: float) -> bool:
        """Whether all that is there is known, and has no such service."""
        offered = self._discovery.offered()  # before the next look, which sees whether anything came since
        if not self._discovery.is_complete() or service in offered:
            return False  # in the second case its endpoints are being matched
        if service.rpartition("/")[0] in self._discovery.nodes():
            return False  # on a loaded machine a node's services arrive seconds after its name
        return waited_s >= (OTHERS_S if _executors(offered) else STARTING_S)

    def _unanswered(self, service: str) -> str:
        said = f"no reply from {service} within {REPLY_TIMEOUT_S:g} s; "
        others = " and ".join(accounts_in_the_way(self._discovery.domain)) if by_fast_dds() else ""
        if not others:
            return f"{said}is its process frozen?"
        return (
            f"{said}is its process frozen, or is it {others}'s, whose shared memory you may not use? "
            "mauve does without it unless ROS_STATIC_PEERS or a profile of Fast DDS says otherwise "
            "(docs/several_machines.md)"
        )

    def _missing(self, service: str) -> str:
        from mauve_rt.file_schema.words import did_you_mean  # noqa: PLC0415 - takes its time to load

        asked, _, name = service.rpartition("/")
        domain = f"ROS_DOMAIN_ID {self._discovery.domain}"
        offered = self._discovery.offered()
        seen = _executors(offered)
        if service in offered:
            return f"{service} is seen in {domain}, but not reached; does the network carry both directions?"
        if not seen:
            return f"no executor {asked}: none is seen at all in {domain}; is it started, in this domain?"
        if asked in seen:
            return f"executor {asked} has no service {name} in {domain}; is it another version of mauve_rt?"
        return f"no executor {asked} in {domain}; {did_you_mean(asked, seen)}"

    def seen_executors(self) -> list[str]:
        """Executors discovered so far."""
        return _executors(self._discovery.offered())

    def find_executors(self, *, wait_s: float = ANNOUNCED_S) -> list[str]:
        """Executors, as soon as all that is there is known; after `wait_s` where that cannot be told."""
        searching = self.search(wait_s=wait_s)
        while (found := next(searching)) is None:
            time.sleep(_LOOK_S)
            _raise_interrupts()
        return found

    def search(self, *, wait_s: float = ANNOUNCED_S) -> Iterator[list[str] | None]:
        """As `find_executors`, but yields None while it searches; the caller waits between two looks."""
        deadline = time.monotonic() + wait_s
        while not self._discovery.is_complete() and time.monotonic() < deadline:
            self._discovery.hurry()
            yield None
        found = self.seen_executors()
        if self._cache is not None:
            self._cache.note_found(found, self._discovery.other_sockets())
        yield found

    def ask_for_list(self, executor: str) -> Any:
        """A future of the executor's ListComponents reply; None while its service is not reached."""
        from mauve_msgs.srv import ListComponents  # noqa: PLC0415 - takes its time to load

        for number, participant in enumerate(self._discovery.participants):
            key = (executor, number)
            if key not in self._list_clients:
                service = executor + _LIST
                self._list_clients[key] = participant.node.create_client(ListComponents, service)
            if self._list_clients[key].service_is_ready():
                return self._list_clients[key].call_async(ListComponents.Request())
        return None

    def note_list(self, executor: str, reply: Any) -> None:
        """Write the names of a ListComponents reply for completions."""
        if self._cache is not None:
            self._cache.note_reply(executor, reply, self._discovery.other_sockets())

    def spin_all(self, wait_s: float) -> None:
        """Take what has come from the network, after a wait."""
        time.sleep(wait_s)
        for participant in self._discovery.participants:
            participant.executor.spin_once(timeout_sec=0)
        _raise_interrupts()

    def poll(self, service_type: Any, service: str, *, every_s: float) -> "Poll":
        """For who asks a service again and again, and waits for no answer."""
        return Poll(self._discovery, service_type, service, every_s=every_s)

    def exchange(self, service_type: Any, service: str) -> Exchange:
        """For a caller that sends a request to a service, and does something else until the reply comes."""
        return Exchange(self._discovery, service_type, service, resend_s=RESEND_S)

    def follow(self, message_type: Any, topic: str, heard: Callable[[Any], None]) -> None:
        """Call `heard` with every message, in spin()."""
        node = self._discovery.participants[0].node
        node.create_subscription(message_type, topic, heard, QoSProfile(depth=100))

    def spin(self) -> None:
        """Take what has come; returns at once, or after 0.05 s where nothing comes. Ctrl-C ends it."""
        self._discovery.hurry()
        first, *others = self._discovery.participants
        for participant in others:
            participant.executor.spin_once(timeout_sec=0)
        _spin_once(first)

    def listen(self, message_type: Any, topic: str, heard: Callable[[Any], None]) -> None:
        """Call `heard` with every message, until KeyboardInterrupt."""
        participant = self._discovery.participants[0]
        participant.node.create_subscription(message_type, topic, heard, QoSProfile(depth=100))
        while True:
            _spin_once(participant)

    def sleep_until(self, instant_s: float) -> None:
        """Until an instant of time.monotonic(); Ctrl-C ends it."""
        while (left_s := instant_s - time.monotonic()) > 0:
            time.sleep(min(left_s, _POLL_S))
            _raise_interrupts()
        _raise_interrupts()

    def _look_again(self) -> None:
        self._discovery.hurry()
        time.sleep(_LOOK_S)
        _raise_interrupts()


class Poll:
    """Asks one service again and again; a request without an answer is given up."""

    def __init__(self, discovery: Discovery, service_type: Any, service: str, *, every_s: float) -> None:
        self._discovery = discovery
        self._type = service_type
        self._service = service
        self._every_s = every_s
        self._clients: list[Any] = []
        self._future: Any = None
        self._due_s = 0.0

    def look(self, request: Callable[[], Any]) -> Any:
        """The answer to the last request, once; None: there is none yet. Asks anew when it is time."""
        reply = None
        if self._future is not None and self._future.done():
            reply, self._future = self._future.result(), None
        now = time.monotonic()
        if now >= self._due_s:
            newer = self._discovery.participants[len(self._clients) :]
            self._clients += [each.node.create_client(self._type, self._service) for each in newer]
            client = next((each for each in self._clients if each.service_is_ready()), None)
            if client is not None and (self._future is None or now >= self._due_s + RESEND_S):
                self._future = client.call_async(request())
                self._due_s = now + self._every_s
        return reply


def _executors(offered: dict[str, list[str]]) -> list[str]:
    return sorted(name.removesuffix(_LIST) for name, types in offered.items() if _LIST_SERVICE in types)


def _spin_once(participant: Participant) -> None:
    participant.executor.spin_once(timeout_sec=_POLL_S)
    _raise_interrupts()


def _raise_interrupts() -> None:
    if _interrupted.is_set():
        raise KeyboardInterrupt


@contextmanager
def _interrupts_between_spins() -> Iterator[None]:
    """Keep Ctrl-C until rclpy has returned: inside of it an exception can be lost, as in a destructor."""
    _interrupted.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def note(_signal: int, _frame: FrameType | None) -> None:
        _interrupted.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def connected(*, first: bool = False) -> Iterator[Client]:
    """A client on a ROS context of its own; this machine only, unless the environment says otherwise.

    With `first` - this process has had no ROS context before - it reaches executors of other accounts, too.
    """
    if problem := domain_problem():
        raise ParameterError(problem)
    cache = Cache.of_environment()  # before the environment is changed
    limit_discovery()
    if unresolved := resolve_static_peers():
        print(f"mauve: {unresolved_text(unresolved)}", file=sys.stderr)
    is_local = stays_on_this_machine()
    with (
        _interrupts_between_spins(),
        by_udp() if first else nullcontext(),
        closing(Discovery(is_local=is_local)) as discovery,
    ):
        try:
            yield Client(discovery, cache)
        except UnsupportedTypeSupport as error:  # as of a package whose libraries are not found
            raise ImportError(str(error)) from error
