"""The exploration mission from one command: runs it, shows how it goes, tells its story, writes the report.

    python -m mauve_examples.mission.demo [--map FILE.yaml] [--robots N] [--duration S] [--link-loss-at S]
        [--link-back-at S] [--no-supervisor] [--drop-share P] [--seed K] [--simulated-time] [--hosts]
        [--out DIR]

Exit status: 0 success, 1 failure, 2 bad input (one line on stderr, nothing started), 130 interrupted.
"""

import signal
import sys
from collections.abc import Sequence
from typing import Any

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.process import leave_now

SUCCESS, FAILURE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


class Interrupts:
    """Ctrl-C and its kin: the first asks the demo to end what it has begun, the next one breaks it off."""

    def __init__(self) -> None:
        self._asked = False
        self._begun = False
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:  # else: nohup
                signal.signal(number, self._on_signal)

    def begin(self) -> None:
        """From here on there is something to end in order; one that comes before ends all at once."""
        self._begun = True

    def asked(self) -> bool:
        """Whether the user wants it to end."""
        return self._asked

    def _on_signal(self, _number: int, _frame: Any) -> None:
        if not self._begun:
            leave_now(INTERRUPTED)
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the demo; returns its exit status."""
    take_first_steps("demo")
    interrupts = Interrupts()
    # Imported here so that Ctrl-C while modules load is handled already.
    from mauve_examples.mission.demo_errors import BadInputError, MissionError  # noqa: PLC0415
    from mauve_rt.cli.pipe import piped  # noqa: PLC0415
    from mauve_rt.node.shared.discovery import limit_discovery  # noqa: PLC0415

    limit_discovery()  # its children's too
    try:
        return piped(lambda: _run(list(sys.argv[1:] if arguments is None else arguments), interrupts))
    except BadInputError as error:
        return _complain(str(error), BAD_INPUT)
    except MissionError as error:
        return _complain(str(error), INTERRUPTED if interrupts.asked() else FAILURE)
    except KeyboardInterrupt:
        return INTERRUPTED


def _run(arguments: list[str], interrupts: Interrupts) -> int:
    from mauve_examples.mission.architecture import load_world  # noqa: PLC0415
    from mauve_examples.mission.demo_errors import BadInputError, MissionError  # noqa: PLC0415
    from mauve_examples.mission.demo_options import parse_options  # noqa: PLC0415
    from mauve_rt.node.shared.failures import failure_text  # noqa: PLC0415
    from mauve_rt.scratch import unwritable  # noqa: PLC0415

    options = parse_options(arguments)
    world = load_world(options.map_file, options.names, seed=options.seed)
    if problem := unwritable(options.out):
        raise BadInputError(
            f"results folder {options.out}: cannot be written ({problem}). Choose another: --out DIR."
        )
    try:
        mission = (_simulate if options.simulated_time else _play)(options, world, interrupts)
        if not mission.started:
            return INTERRUPTED
        return _report(options, world, mission, interrupts)
    except BrokenPipeError:
        raise  # the reader of the output is gone
    except OSError as error:
        raise MissionError(f"results folder {options.out}: {failure_text(error)}") from error


def _play(options: Any, world: Any, interrupts: Interrupts) -> Any:
    """In real time: processes, and ROS 2 to see them by."""
    import rclpy  # noqa: PLC0415
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415
    from rclpy.utilities import try_shutdown  # noqa: PLC0415

    from mauve_examples.mission.cable import open_cable  # noqa: PLC0415
    from mauve_examples.mission.demo_errors import BadInputError  # noqa: PLC0415
    from mauve_examples.mission.demo_run import MissionRun  # noqa: PLC0415
    from mauve_examples.mission.progress import open_progress  # noqa: PLC0415
    from mauve_rt.node.shared.ros_start import RosStartError, settle_ros_start  # noqa: PLC0415

    interrupts.begin()
    with open_cable(options) as cable:
        try:
            start = settle_ros_start()
        except RosStartError as error:
            raise BadInputError(str(error)) from None
        rclpy.init(args=list(start.arguments), signal_handler_options=SignalHandlerOptions.NO)
        try:
            with open_progress() as progress:
                for remark in start.remarks:
                    progress.say(f"Warning: {remark}")
                mission = MissionRun(
                    options, world, progress=progress, interrupted=interrupts.asked, cable=cable
                )
                mission.run()
        finally:
            try_shutdown()
    return mission


def _simulate(options: Any, world: Any, interrupts: Interrupts) -> Any:
    from mauve_examples.mission.demo_simulated import SimulatedMission  # noqa: PLC0415
    from mauve_examples.mission.progress import open_progress  # noqa: PLC0415

    interrupts.begin()
    with open_progress() as progress:
        mission = SimulatedMission(options, world, progress=progress, interrupted=interrupts.asked)
        mission.run()
    return mission


def _report(options: Any, world: Any, mission: Any, interrupts: Interrupts) -> int:
    from mauve_examples.mission.demo_ending import ending, summarise  # noqa: PLC0415

    facts = mission.facts()
    supervised = _simulate_supervised(options, world, interrupts)
    if interrupts.asked():  # who presses Ctrl-C wants to be gone within 3 s: figures, but no drawings
        summary = summarise(options.out, facts, world.area)
    else:
        from mauve_examples.mission.results import write_results  # noqa: PLC0415

        summary = write_results(options.out, facts, area=world.area, supervised=supervised)
    print(ending(options.out, summary), flush=True)
    if interrupts.asked():
        return INTERRUPTED
    return SUCCESS if summary["success"] else FAILURE


def _simulate_supervised(options: Any, world: Any, interrupts: Interrupts) -> Any:
    """The same mission with supervisors, for one that was to go without; None for others."""
    if options.supervisor or options.link_loss_at_s is None or interrupts.asked():
        return None
    from mauve_examples.mission.progress import open_progress  # noqa: PLC0415
    from mauve_examples.mission.supervised_run import simulate_supervised  # noqa: PLC0415

    with open_progress() as progress:
        return simulate_supervised(options, world, progress=progress, interrupted=interrupts.asked)


def _complain(text: str, status: int) -> int:
    sys.stderr.write(f"demo: {' '.join(text.split())}\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
