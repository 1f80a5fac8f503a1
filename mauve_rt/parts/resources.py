"""Resources: data of the given kinds, and ones written in Python with services of their own."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, Generic, Self, TypeVar, overload

from mauve_rt._kernel import NO_LOG, DataResource, Host, Log, PartFactory, ResourceParameter
from mauve_rt.parts import messages
from mauve_rt.parts.part import Configurable, implementation_name
from mauve_rt.parts.ports import Sample

__all__ = [
    "ActionClient",
    "ActionServer",
    "AnyResource",
    "DataOfKind",
    "EventCounter",
    "LatestValue",
    "Parameter",
    "Resource",
    "RingBuffer",
    "SharedData",
    "TransformTree",
    "parameter",
    "read_resource",
    "service",
    "service_type",
]

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])
V = TypeVar("V", bound=bool | int | float | str)
_MARK = "_mauve_service"


@overload
def service(method: F) -> F: ...
@overload
def service(method: str) -> Callable[[F], F]: ...
def service(method: F | str) -> F | Callable[[F], F]:
    """Make a method of a resource a service that call ports connect to.

        class Map(Resource):
            @service
            def update(self, x: float, y: float) -> bool: ...

            @service("my_package/MapVisitor")   # under a type name of its own
            def visit(self, visitor: Callable[[Grid], None]) -> None: ...

    Without a name the type is `package/Class.method`. Services run on the caller's thread under the
    interpreter's lock, which is their only one. Ports of components in C++ do not connect to them.
    """
    if not isinstance(method, str):
        setattr(method, _MARK, f"{method.__module__.partition('.')[0]}/{method.__qualname__}")
        return method
    name = method

    def mark(marked: F) -> F:
        setattr(marked, _MARK, name)
        return marked

    return mark


def service_type(method: Callable[..., Any]) -> str:
    """The type of a service.

    Raises:
        TypeError: the function is no service.
    """
    found = getattr(method, _MARK, None)
    if found is None:
        raise TypeError(f"{method.__qualname__} is no service: it lacks @service")
    return str(found)


class Parameter(Generic[V]):
    """A parameter of a resource written in Python, declared by `parameter`; of an object its value."""

    def __init__(self, initial: V, **facts: Any) -> None:
        self.initial = initial
        self._facts = facts
        self._name = ""

    def __set_name__(self, _owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, resource: None, _owner: type) -> Self: ...
    @overload
    def __get__(self, resource: object, _owner: type) -> V: ...
    def __get__(self, resource: object | None, _owner: type) -> Self | V:
        if resource is None:
            return self
        value: V = vars(resource).get(self._name, self.initial)
        return value

    def __set__(self, resource: object, value: V) -> None:
        vars(resource)[self._name] = value

    def described(self) -> ResourceParameter:
        """As the kernel takes it."""
        return ResourceParameter(self._name, self.initial, **self._facts)


def parameter(
    initial: V,
    *,
    unit: str = "",
    description: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    required: bool = False,
) -> Parameter[V]:
    """A parameter of a resource written in Python: bool, int, float or str, by its initial value.

        class Window(Resource):
            length = parameter(10, unit="samples", description="how far it looks back", minimum=1)

    Architecture files have it as a key of the resource, `add_resource` as a keyword. It is set once, before
    configure().
    """
    return Parameter(
        initial, unit=unit, description=description, minimum=minimum, maximum=maximum, required=required
    )


class AnyResource(ABC):
    """What `Architecture.add_resource` takes."""

    @abstractmethod
    def _instance_part(self) -> PartFactory | DataResource:
        """How the kernel makes it."""


class Resource(Configurable, AnyResource):
    """Base of resources written in Python; its methods marked by `service` are what ports connect to."""

    _log: Log = NO_LOG

    def log(self) -> Log:
        """Lines of this resource, also those of its services on the threads of components."""
        return self._log

    @classmethod
    def _part(cls) -> PartFactory:
        return PartFactory("resource", implementation_name(cls), cls)

    def _instance_part(self) -> PartFactory:
        return PartFactory("resource", implementation_name(type(self)), lambda: self)

    @classmethod
    def _parameters(cls) -> list[ResourceParameter]:
        found = {name: each for base in reversed(cls.__mro__) for name, each in vars(base).items()}
        return [each.described() for each in found.values() if isinstance(each, Parameter)]

    def _services(self) -> list[tuple[str, str]]:
        """(name, type) of each service; a method that overrides one stays it."""
        found: dict[str, str] = {}
        for base in reversed(type(self).__mro__):
            for name, attribute in vars(base).items():
                if (kind := getattr(attribute, _MARK, None)) is not None:
                    found[name] = kind
        return list(found.items())


class DataOfKind(AnyResource, Generic[T]):
    """A resource of a given kind by its name: what it may be told is the kind's own."""

    def __init__(self, kind: str, type: type[T] | str, **parameters: bool | float | str) -> None:  # noqa: A002
        name = messages.type_name(type)
        self._resource = DataResource(
            kind=kind,
            type=name,
            parameters=parameters,
            zeros=messages.zeros(name) if name else [],
            frame_ids=messages.frame_ids(messages.message_class(name)) if name else 0,
        )

    def _instance_part(self) -> DataResource:
        return self._resource


class SharedData(DataOfKind[T]):
    """The newest value; services `read` and `write`.

    A message type that no loaded library registered is held serialized, up to `max_bytes` (65,536): then
    components in Python and topics share it, and ports of components in C++ are refused. For a type that a
    library registered, `capacities` says how many elements each sequence of the message holds:
    `{"markers.points": 64}`.
    """

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        *,
        max_bytes: int | None = None,
        capacities: Mapping[str, int] | None = None,
    ) -> None:
        super().__init__("shared_data", type, **_told(max_bytes=max_bytes), **_capacities(capacities))


class RingBuffer(DataOfKind[T]):
    """A queue of `capacity` elements; a read removes, so each element goes to one reader.

    `max_bytes` and `capacities`: as of `SharedData`.
    """

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        capacity: int,
        *,
        overwrite: bool = False,
        max_bytes: int | None = None,
        capacities: Mapping[str, int] | None = None,
    ) -> None:
        told = _told(capacity=capacity, overwrite=overwrite, max_bytes=max_bytes)
        super().__init__("ring_buffer", type, **told, **_capacities(capacities))


class LatestValue(DataOfKind[T]):
    """The newest value of one writer, read without a lock; for types that a loaded library registered."""

    def __init__(self, type: type[T] | str, *, max_readers: int | None = None) -> None:  # noqa: A002
        super().__init__("latest_value", type, **_told(max_readers=max_readers))


class ActionServer(DataOfKind[Any]):
    """Goals of an action for a component: `goals` (1) at once, each answered within `answer_ns` (0.1 s).

    `type`: a class of a ROS action such as `DriveTo`, or its name. Goals, results and feedback of a type that
    no loaded library registered are held serialized, each up to `max_bytes` (65,536), as by `SharedData`.
    """

    def __init__(
        self,
        type: Any,  # noqa: A002
        *,
        goals: int | None = None,
        answer_ns: int | None = None,
        max_bytes: int | None = None,
    ) -> None:
        told = _told(goals=goals, answer_ns=answer_ns, max_bytes=max_bytes)
        name = type if isinstance(type, str) else messages.action_name(type)
        super().__init__("action_server", name, **told)


class ActionClient(DataOfKind[Any]):
    """The goals of a component for a server, one at a time, each answered within `answer_ns` (1 s).

    `type` and `max_bytes`: as of `ActionServer`.
    """

    def __init__(
        self,
        type: Any,  # noqa: A002
        *,
        answer_ns: int | None = None,
        max_bytes: int | None = None,
    ) -> None:
        told = _told(answer_ns=answer_ns, max_bytes=max_bytes)
        name = type if isinstance(type, str) else messages.action_name(type)
        super().__init__("action_client", name, **told)


class EventCounter(DataOfKind[int]):
    """Counts events that event ports raise."""

    def __init__(self) -> None:
        super().__init__("event", "")


class TransformTree(DataOfKind[Any]):
    """The frames of a robot: at most `frames` (64), with the latest `history` (256) transforms of each.

    Its services `set` and `lookup` are called by `request_port(SetTransform)` and
    `request_port(LookupTransform)`, of `mauve_msgs.srv`.
    """

    def __init__(self, *, frames: int | None = None, history: int | None = None) -> None:
        super().__init__("transform_tree", "", **_told(frames=frames, history=history))


def _capacities(capacities: Mapping[str, int] | None) -> dict[str, int]:
    return {f"capacity.{path}": count for path, count in (capacities or {}).items()}


def _told(**parameters: int | None) -> dict[str, int]:
    return {name: value for name, value in parameters.items() if value is not None}


def read_resource(host: Host, resource: str, type: type[T]) -> Sample[T]:  # noqa: A002
    """What a `shared_data` resource holds, for tests and programs; the message's default before any write.

    Raises:
        MauveError: there is no such resource, or it is of another kind.
        TypeError: `type` is no class of ROS messages.
    """
    messages.type_name(type)
    data, sequence, time_ns = host.read_resource(resource)
    return Sample(messages.deserialize(data, type), "new" if sequence else "none", time_ns)
