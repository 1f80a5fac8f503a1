"""One request to a service, whose reply the caller polls for."""

from typing import Any

from mauve_rt.cli.discovery import Discovery


class Exchange:
    """Sends one request at a time to one service. A reply can be lost: the request is sent again.

    Requests carry an id: an executor that receives one twice returns the first outcome. For one thread.
    """

    def __init__(self, discovery: Discovery, service_type: Any, service: str, *, resend_s: float) -> None:
        self._discovery = discovery
        self._type = service_type
        self._service = service
        self._resend_s = resend_s
        self._clients: list[Any] = []
        self._futures: list[Any] = []
        self._request: Any = None
        self._sent_s = 0.0

    def is_ready(self) -> bool:
        """Whether the service is reached."""
        return self._ready_client() is not None

    @property
    def is_busy(self) -> bool:
        """Whether a request waits for its reply."""
        return self._request is not None

    def send(self, request: Any) -> None:
        """Send a request, at the next look(); an earlier one without a reply is given up."""
        self._request, self._futures, self._sent_s = request, [], 0.0

    def look(self, now_s: float) -> Any:
        """The reply, once; None: there is none yet."""
        if self._request is None:
            return None
        for future in self._futures:
            if future.done():
                self._request, self._futures = None, []
                return future.result()
        if not self._futures or now_s >= self._sent_s + self._resend_s:
            client = self._ready_client()
            if client is not None:
                self._futures.append(client.call_async(self._request))
                self._sent_s = now_s
        return None

    def _ready_client(self) -> Any:
        newer = self._discovery.participants[len(self._clients) :]
        self._clients += [each.node.create_client(self._type, self._service) for each in newer]
        return next((each for each in self._clients if each.service_is_ready()), None)
