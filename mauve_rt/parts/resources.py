"""Resources: data of the given kinds, and ones written in Python with services of their own."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

from mauve_rt._kernel import DEFAULT_MAX_READERS, DataResource, PartFactory
from mauve_rt.parts import messages
from mauve_rt.parts.part import Configurable, implementation_name

__all__ = [
    "AnyResource",
    "EventCounter",
    "LatestValue",
    "Resource",
    "RingBuffer",
    "SharedData",
    "service",
    "service_type",
]

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])
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


class AnyResource(ABC):
    """What `Architecture.add_resource` takes."""

    @abstractmethod
    def _instance_part(self) -> PartFactory | DataResource:
        """How the kernel makes it."""


class Resource(Configurable, AnyResource):
    """Base of resources written in Python; its methods marked by `service` are what ports connect to."""

    @classmethod
    def _part(cls) -> PartFactory:
        return PartFactory("resource", implementation_name(cls), cls)

    def _instance_part(self) -> PartFactory:
        return PartFactory("resource", implementation_name(type(self)), lambda: self)

    def _services(self) -> list[tuple[str, str]]:
        """(name, type) of each service; a method that overrides one stays it."""
        found: dict[str, str] = {}
        for base in reversed(type(self).__mro__):
            for name, attribute in vars(base).items():
                if (kind := getattr(attribute, _MARK, None)) is not None:
                    found[name] = kind
        return list(found.items())


class _Data(AnyResource, Generic[T]):
    kind = ""

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002 - the word of the field
        *,
        capacity: int = 0,
        overwrite: bool = False,
        max_bytes: int = 4096,
        max_readers: int = DEFAULT_MAX_READERS,
    ) -> None:
        name = messages.type_name(type)
        self._resource = DataResource(
            kind=self.kind,
            type=name,
            capacity=capacity,
            overwrite=overwrite,
            max_bytes=max_bytes,
            max_readers=max_readers,
            zero=messages.zero(name),
        )

    def _instance_part(self) -> DataResource:
        return self._resource


class SharedData(_Data[T]):
    """The newest value; services `read` and `write`.

    A message type that no loaded library registered is held serialized, up to `max_bytes`: then components
    in Python and topics share it, and ports of components in C++ are refused.
    """

    kind = "shared_data"

    def __init__(self, type: type[T] | str, *, max_bytes: int = 4096) -> None:  # noqa: A002
        super().__init__(type, max_bytes=max_bytes)


class RingBuffer(_Data[T]):
    """A queue of `capacity` elements; a read removes, so each element goes to one reader."""

    kind = "ring_buffer"

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        capacity: int,
        *,
        overwrite: bool = False,
        max_bytes: int = 4096,
    ) -> None:
        super().__init__(type, capacity=capacity, overwrite=overwrite, max_bytes=max_bytes)


class LatestValue(_Data[T]):
    """The newest value of one writer, read without a lock; for types that a loaded library registered."""

    kind = "latest_value"

    def __init__(self, type: type[T] | str, *, max_readers: int = DEFAULT_MAX_READERS) -> None:  # noqa: A002
        super().__init__(type, max_readers=max_readers)


class EventCounter(_Data[int]):
    """Counts events that event ports raise."""

    kind = "event"

    def __init__(self) -> None:
        super().__init__("")
