"""Writes the log lines of components and resources to the console, /rosout and the bag; sets their levels."""

import threading
from typing import Any

import rclpy.logging
from builtin_interfaces.msg import Time
from rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.callback_groups import CallbackGroup
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.lifecycle import LifecycleNode
from rclpy.serialization import serialize_message

from mauve_rt._bridge import write_log_line
from mauve_rt._kernel import monotonic_ns
from mauve_rt.control.part_log import LogBundles, LogLine
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import MauveError
from mauve_rt.interfaces.log_messages import LEVELS, LOG_TYPE, ROSOUT, SEVERITIES, log_message, logger_name
from mauve_rt.node.executor.recording import Recording
from mauve_rt.node.shared.watch import Watch

_PERIOD_S = 0.05  # a ring holds the lines of 0.1 s of a component that writes one in each ms
_END_S = 2.0


class PartLog:
    """Of one executor; a thread of its own until close().

    | member       | written by          | guarded by |
    | ------------ | ------------------- | ---------- |
    | `_bundles`   | who writes          | `_lock`    |
    | `_loggers`   | who writes, close() | `_lock`    |
    """

    def __init__(self, node: LifecycleNode, runtime: Runtime, recording: Recording, watch: Watch) -> None:
        """Write from now on."""
        self._node = node
        self._runtime = runtime
        self._recording = recording
        self._watch = watch
        self._lock = threading.Lock()
        self._bundles = LogBundles()
        self._loggers: dict[str, RcutilsLogger] = {}
        self._ending = threading.Event()
        self._thread = watch.thread("part_log", self._look, ending=self._ending)
        self._thread.start()

    def _write_all(self, *, last: bool) -> None:
        """Write what has come; with the `last` also what was withheld to be bundled."""
        with self._lock:
            now_ns = monotonic_ns()
            lines = self._bundles.take(self._runtime.take_log(), now_ns=now_ns, last=last)
            if not lines:
                return
            ahead_ns = self._node.get_clock().now().nanoseconds - now_ns
            for line in lines:
                self._write(line, line.time_ns + ahead_ns)

    def write_last(self) -> None:
        """Write all that there is; what fails there holds up no stop."""
        self._watch.guarded("the log of parts", self._write_all)(last=True)

    def close(self) -> None:
        """Write the last lines, and end."""
        self._ending.set()
        self._thread.join(_END_S)
        self.write_last()
        with self._lock:
            self._loggers.clear()

    def open_services(self, group: CallbackGroup) -> None:
        """Offer the services of ROS for levels of loggers, by the names of ROS."""
        name = self._node.get_name()
        self._node.create_service(
            GetLoggerLevels, f"{name}/get_logger_levels", self._get_levels, callback_group=group
        )
        self._node.create_service(
            SetLoggerLevels, f"{name}/set_logger_levels", self._set_levels, callback_group=group
        )

    def _look(self) -> None:
        self._ending.wait(_PERIOD_S)
        self._write_all(last=False)

    def _write(self, line: LogLine, realtime_ns: int) -> None:
        if line.part and line.part not in self._loggers:  # /rosout takes lines of loggers that it knows
            self._loggers[line.part] = RcutilsLogger(self._node.get_logger().name).get_child(line.part)
        node = self._node.get_fully_qualified_name()
        write_log_line(
            SEVERITIES[line.level],
            logger_name(node, line.part),
            realtime_ns,
            line.text,
            line.function,
            line.file,
            line.line,
        )
        if self._recording.recording and not self._recording.takes(ROSOUT):
            seconds, nanoseconds = divmod(realtime_ns, 1_000_000_000)
            message = log_message(line, node=node, stamp=Time(sec=seconds, nanosec=nanoseconds))
            data = bytes(serialize_message(message))
            self._recording.record(ROSOUT, LOG_TYPE, data, instant_ns=line.time_ns)

    def _part_of(self, logger: str) -> str:
        """The component or resource that has this logger; "": none."""
        prefix = f"{self._node.get_logger().name}."
        return logger.removeprefix(prefix) if logger.startswith(prefix) else ""

    def _get_levels(self, request: Any, response: Any) -> Any:
        response.levels = [LoggerLevel(name=name, level=self._level(name)) for name in request.names]
        return response

    def _level(self, logger: str) -> int:
        if part := self._part_of(logger):
            try:
                return SEVERITIES[self._runtime.architecture.log_level(part)]
            except MauveError:
                pass
        return int(rclpy.logging.get_logger_level(logger))

    def _set_levels(self, request: Any, response: Any) -> Any:
        response.results = [self._set_level(each.name, each.level) for each in request.levels]
        return response

    def _set_level(self, logger: str, severity: int) -> SetLoggerLevelsResult:
        try:
            if severity not in LEVELS:
                expected = ", ".join(f"{number} ({level})" for number, level in LEVELS.items())
                return SetLoggerLevelsResult(
                    reason=f"level of {logger}: expected {expected}, found {severity}"
                )
            if part := self._part_of(logger):
                self._runtime.architecture.set_log_level(part, LEVELS[severity])
            else:
                rclpy.logging.set_logger_level(logger, severity, detailed_error=True)
        except (MauveError, RuntimeError, ValueError) as error:
            return SetLoggerLevelsResult(reason=str(error))
        return SetLoggerLevelsResult(successful=True)
