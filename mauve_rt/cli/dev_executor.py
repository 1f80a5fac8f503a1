"""The executor that `mauve dev` reloads: whether it answers, and the reloads of its code."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mauve_msgs.msg import ReplyCode
from mauve_msgs.srv import ListComponents, ReadValues, Reload
from mauve_rt.cli.client import Client
from mauve_rt.cli.dev_outputs import output_names
from mauve_rt.cli.dev_reload import Links, ReloadRun

_LIST_S = 0.5  # between two requests: the verdict on new code is in the reply
_LOST_S = 3.0


@dataclass(frozen=True)
class Trial:
    """How new code is tried."""

    targets: Sequence[str] = ()
    probation_s: float = 0.0
    revert_on: Sequence[str] = ()


class DevExecutor:
    """One executor, polled without waiting for it. For one thread."""

    def __init__(self, client: Client, name: str, trial: Trial) -> None:
        self.name = name
        self._trial = trial
        self._instance_id = ""
        self._components: Sequence[Any] = ()
        self._heard_s = 0.0
        self.refusal: str | None = None if trial.probation_s and trial.revert_on else ""
        """Why the executor would refuse this probation; empty: it would not; None: not known yet."""
        self._check = client.exchange(Reload, f"{name}/reload")
        self._list = client.poll(ListComponents, f"{name}/list_components", every_s=_LIST_S)
        self._links = Links(
            reload=client.exchange(Reload, f"{name}/reload"),
            read=client.exchange(ReadValues, f"{name}/read_values"),
            components=lambda: self._components,
        )
        for exchange in (self._links.reload, self._links.read):
            exchange.is_ready()  # makes the clients now: the executor knows them when a request comes

    @property
    def is_there(self) -> bool:
        """Whether it has answered lately."""
        return bool(self._instance_id) and time.monotonic() < self._heard_s + _LOST_S

    @property
    def instance_id(self) -> str:
        """New at each start of the executor; empty: it never answered."""
        return self._instance_id

    def look(self) -> None:
        """Take replies, and send requests that are due."""
        if (reply := self._list.look(ListComponents.Request)) is not None:
            self._instance_id, self._components = reply.instance_id, reply.components
            self._heard_s = time.monotonic()
            if self.refusal is None and not self._check.is_busy:
                request = self._request()
                request.dry_run = True
                self._check.send(request)
        if (checked := self._check.look(time.monotonic())) is not None:
            self.refusal = checked.message if checked.code == ReplyCode.INVALID else ""

    def reload(self, *, back: bool) -> ReloadRun:
        """Begin a reload: of the rebuilt code on probation, or of the code before, without a probation."""
        request = self._request() if not back else Reload.Request(targets=[*self._trial.targets], back=True)
        request.requested_by = "mauve dev"
        return ReloadRun(self._links, request, output_names(self._components, request.targets))

    def _request(self) -> Any:
        trial = self._trial
        return Reload.Request(
            targets=[*trial.targets],
            probation_s=trial.probation_s,
            revert_on=[*trial.revert_on] if trial.probation_s else [],
        )
