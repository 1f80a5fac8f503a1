"""The executor process: runs the architecture of a file.

    ros2 run mauve_rt executor --ros-args -p architecture:=FILE [-p rules:=FILE] [-r __ns:=/robot_1]
        [-p bag:=DIR] [-p autostart:=false] [-p require_realtime:=true] [-p trace:=false]
        [-p peers:=[robot_2]] [-p COMPONENT.PROPERTY:=VALUE]
        [-p record_topics:="['supervisor/decisions:mauve_msgs/msg/SupervisorDecision:transient_local']"]

Exit status: 0 after SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1 or SIGUSR2, 2 for bad input (one line on
stderr, nothing started), 1 otherwise.
"""

import gc
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.loopback import Reach, reach, udp_sockets
from mauve_rt.node.shared.process import (
    BAD_INPUT,
    FAILED,
    Stop,
    asks_for_help,
    complain,
    leave_now,
    run_until_signalled,
)
from mauve_rt.node.shared.ros_start import RosStart, RosStartError, settle_ros_start

SWITCH_INTERVAL_S = 1e-4  # Python components wait at most so long for the interpreter's lock
_SPIN_S = 0.2  # how long a stop may go unnoticed
_ANSWER_S = 0.5  # for requests to come to their answers by themselves, everything being stopped


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run until signalled, then end the process.

    It ends without the interpreter's own tidying up: all that has to be ended in order is ended by then,
    destroying objects while a component's state still executes is not safe, and libraries' exit handlers were
    seen to hang.
    """
    take_first_steps("executor")
    words = list(sys.argv if arguments is None else arguments)
    if asks_for_help(words):
        from mauve_rt.node.executor.settings import help_text  # noqa: PLC0415 - takes its time to load

        sys.stdout.write(help_text())
        leave_now(0)
    try:
        start = settle_ros_start()
    except RosStartError as error:
        complain(f"executor: {error}")
        leave_now(BAD_INPUT)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.disable()  # all that is loaded stays: looking for garbage in it is a tenth of the start's work
    leave_now(run_until_signalled(lambda stop: _work(words, start, stop), program="executor"))


def _work(words: list[str], start: RosStart, stop: Stop) -> int:
    # Imported here so that a signal while modules load is handled; what takes long comes before begin().
    import mauve_rt.node.executor.node  # noqa: F401, PLC0415
    from mauve_rt.errors import MauveError, error_code  # noqa: PLC0415
    from mauve_rt.node.executor.settings import Settings  # noqa: PLC0415

    stop.begin()
    try:
        settings = Settings.of(words)
        runtime = settings.runtime()
        if settings.autostart:
            runtime.configure()  # before ROS: a bad file starts nothing
    except MauveError as error:
        complain(f"executor: {error}")
        return FAILED if error_code(error) == "realtime_denied" else BAD_INPUT
    return 0 if stop.is_set() else _with_ros(words, runtime, settings, start, stop)


def _with_ros(words: list[str], runtime: Any, settings: Any, start: RosStart, stop: threading.Event) -> int:
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415
    from rclpy.utilities import try_shutdown  # noqa: PLC0415

    from mauve_rt.node.executor.node import ExecutorNode  # noqa: PLC0415
    from mauve_rt.node.shared.announcement import first_participant  # noqa: PLC0415
    from mauve_rt.node.shared.background_console import init_logging_apart, last_lines  # noqa: PLC0415
    from mauve_rt.node.shared.late_peers import LatePeers  # noqa: PLC0415
    from mauve_rt.node.shared.network_interfaces import NetworkInterfaces, usable_addresses  # noqa: PLC0415

    node, discovery, opens_late = None, None, False
    addresses, sockets = usable_addresses(), udp_sockets()
    try:
        init_logging_apart([*words, *start.arguments], signal_handler_options=SignalHandlerOptions.NO)
        namespace = runtime.model.namespace if runtime.configured else settings.node_namespace()
        with first_participant():
            node = ExecutorNode(runtime, namespace=namespace, settings=settings.values)
        discovery = reach(sockets)
        node.access = discovery.access
        # Components in Python would wait for the interpreter while modules load: then these come first.
        waits_for_python = any(map(runtime.has_python_parts, runtime.components()))
        opens_late = settings.autostart and not waits_for_python
    except Exception as error:  # noqa: BLE001 - rclpy has an exception class of its own for each mistake
        complain(f"executor: {error}")
    if discovery is None or node is None or not (opens_late or _open(node)):
        node = None
        gc.collect()  # what there is of the node holds itself alone, and the DDS participant with it
        last_lines()
        try_shutdown()
        return BAD_INPUT
    for remark in (*start.remarks, *settings.remarks):
        node.get_logger().warning(remark)
    status = FAILED
    interfaces = NetworkInterfaces(node, node.watch, before=addresses)
    late_peers = LatePeers(node, node.watch, start.unresolved)
    try:
        if settings.autostart:
            status = _autostart(node, stop, discovery)
        else:
            discovery.log(node.get_logger())
            status = 0
        if status == 0 and opens_late and not _open(node):
            status = BAD_INPUT
        if status == 0:
            status = _spin(node, stop)
    finally:
        interfaces.close()
        late_peers.close()
        node.close()
        last_lines()
        try_shutdown()
    return status


def _open(node: Any) -> bool:
    """Let the node offer its services; on failure print why and return False."""
    try:
        node.open()
    except Exception as error:  # noqa: BLE001 - as above
        complain(f"executor: {error}")
        return False
    gc.freeze()  # what is loaded stays: not to be looked at while components wait for the interpreter
    gc.enable()
    return True


def _autostart(node: Any, stop: threading.Event, discovery: Reach) -> int:
    status = _change_state(node.trigger_configure, stop, refused=BAD_INPUT)
    if status == 0:
        discovery.log(node.get_logger())  # before anything runs; bad input has one line of its own
        status = _change_state(node.trigger_activate, stop, refused=FAILED)
    return status


def _change_state(transition: Callable[[], Any], stop: threading.Event, *, refused: int) -> int:
    from rclpy.lifecycle import TransitionCallbackReturn  # noqa: PLC0415

    result = TransitionCallbackReturn.SUCCESS if stop.is_set() else transition()
    if result == TransitionCallbackReturn.SUCCESS:
        return 0
    return FAILED if result == TransitionCallbackReturn.ERROR else refused


def _spin(node: Any, stop: threading.Event) -> int:
    from mauve_rt.node.executor.services import is_change  # noqa: PLC0415
    from mauve_rt.node.shared.service_thread import OtherGroupsExecutor, ServiceThreads  # noqa: PLC0415

    requests = ServiceThreads(node, node.control_group, node.watch, is_change=is_change, sign=node.sign)
    requests.start()
    executor = OtherGroupsExecutor(node.control_group, num_threads=node.THREADS)
    executor.add_node(node)
    while not stop.is_set() and not node.watch.broken.is_set():
        try:
            executor.spin_once(timeout_sec=_SPIN_S)
        except BaseException as error:  # noqa: BLE001 - a malformed request must not end the process
            node.watch.tell("taking a message or request", error)
    node.quiesce()  # ends what a request may be waiting for
    requests.stop(wait_s=_ANSWER_S, message="the executor ends; what was not in force by then never will be")
    # Jazzy's executor leaves its pool running; a callback that comes later would find the node destroyed.
    executor._executor.shutdown(wait=True, cancel_futures=True)  # noqa: SLF001
    executor.shutdown(timeout_sec=0)
    return FAILED if node.watch.broken.is_set() else 0


if __name__ == "__main__":
    main()
