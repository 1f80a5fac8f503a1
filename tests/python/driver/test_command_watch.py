"""What a driver does where commands come, come late, or come no more."""

import math
import threading

import pytest

from mauve_rt.driver import CommandWatch


class Clock:
    """Set by the test."""

    def __init__(self) -> None:
        self.now_ns = 5_000_000_000

    def __call__(self) -> int:
        return self.now_ns


def test_a_command_is_taken_until_it_is_old() -> None:
    clock = Clock()
    watch = CommandWatch(0.3, safe=0.0, now_ns=clock)
    assert (watch.value, watch.is_safe, watch.age_s) == (0.0, True, math.inf)
    watch.received(1.5)
    assert (watch.value, watch.is_safe, watch.age_s) == (1.5, False, 0.0)
    clock.now_ns += 299_999_999
    assert (watch.value, watch.is_safe) == (1.5, False)
    clock.now_ns += 1
    assert (watch.value, watch.is_safe, watch.age_s) == (0.0, True, 0.3)
    watch.received(2.5)
    assert (watch.value, watch.is_safe) == (2.5, False)


@pytest.mark.parametrize("timeout_s", [0, -1.0, math.nan, math.inf])
def test_a_timeout_that_never_ends_is_refused(timeout_s: float) -> None:
    with pytest.raises(ValueError, match="expected a positive number of seconds"):
        CommandWatch(timeout_s, safe=0)


def test_readers_beside_a_receiver_get_whole_commands() -> None:
    watch = CommandWatch(60.0, safe=(0, 0))
    ending = threading.Event()
    torn: list[tuple[int, int]] = []

    def read() -> None:
        while not ending.is_set():
            if (value := watch.value)[0] != value[1]:
                torn.append(value)

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    for number in range(20_000):
        watch.received((number, number))
    ending.set()
    for reader in readers:
        reader.join()
    assert not torn
