"""Requests and the memory of those already answered."""

from dataclasses import replace

from mauve_rt.control.requests import (
    Code,
    Outcome,
    RecordingOrder,
    Report,
    Request,
    RequestLog,
    Step,
)

STOP = Request(steps=(Step("stop", "a"),), request_id="1")
DONE = Outcome(code=Code.OK, message="done", revision=4)


def test_repeated_request_gets_the_first_outcome() -> None:
    log = RequestLog()
    assert log.find(STOP) is None
    log.add(STOP, DONE)
    assert log.find(STOP) is DONE


def test_same_id_with_other_contents_is_refused() -> None:
    log = RequestLog()
    log.add(STOP, DONE)
    for other in (
        Request(steps=(Step("stop", "b"),), request_id="1"),
        Request(steps=(Step("stop", "a"),), request_id="1", expected_revision=3),
        Request(steps=(Step("stop", "a"),), request_id="1", dry_run=True),
        Request(steps=(Step("stop", "a"),), request_id="1", cause="another"),
    ):
        outcome = log.find(other)
        assert outcome is not None
        assert outcome.code is Code.REQUEST_ID_REUSED
        assert "for: stop a" in outcome.message


def test_no_id_is_never_remembered() -> None:
    log = RequestLog()
    request = Request(steps=(Step("stop", "a"),))
    log.add(request, DONE)
    assert log.find(request) is None


def test_the_last_1024_are_kept() -> None:
    log = RequestLog()
    requests = [Request(steps=(Step("stop", "a"),), request_id=str(number)) for number in range(1025)]
    for request in requests:
        log.add(request, DONE)
    assert log.find(requests[0]) is None
    assert log.find(requests[1]) is DONE
    assert log.find(requests[1024]) is DONE


def test_words_of_a_request() -> None:
    step = Step("set_property", "guidance", "path_step", "0.5")
    assert str(Request(steps=(step,), dry_run=True)) == "set_property guidance path_step 0.5 (dry run)"
    assert str(Request(steps=(Step("stop", "a"), Step("start", "b")))) == "stop a; start b"


def test_requests_own_no_memory() -> None:
    log = RequestLog()
    long = Request(steps=(Step("replace_core", "a", "x" * 100_000),), request_id="y" * 100_000)
    log.add(long, DONE)
    assert log.find(long) is DONE
    assert sum(len(repr(entry)) for entry in log._entries.items()) < 2000
    other = replace(long, steps=(Step("replace_core", "a", "x" * 99_999 + "z"),))
    outcome = log.find(other)
    assert outcome is not None
    assert outcome.code is Code.REQUEST_ID_REUSED
    assert len(outcome.message) < 1000


def test_an_outcome_is_no_longer_than_people_read() -> None:
    report = (Report(step="s" * 50_000, component="a"),)
    outcome = Outcome(code=Code.INVALID, message="m" * 50_000, report=report, to_core="c" * 50_000).cut()
    assert len(repr(outcome)) < 6000
    assert outcome.message.endswith("...")
    assert DONE.cut() == DONE


def test_two_requests_have_one_digest_only_where_they_are_equal() -> None:
    requests = [
        Request(steps=(Step("stop", "a"),)),
        Request(steps=(Step("stop", "a"), Step("stop", "a"))),
        Request(steps=(Step("stop", "a', target='b"),)),
        Request(steps=(Step("stop", "a\udcff"),)),
        Request(steps=(Step("stop", "a"),), dry_run=True),
        Request(recording=RecordingOrder(kind="start")),
        Request(recording=RecordingOrder(kind="start", topics=("a", "b"))),
        Request(recording=RecordingOrder(kind="start", topics=("a, b",))),
    ]
    assert len({request.digest() for request in requests}) == len(requests)
    assert requests[0].digest() == Request(steps=(Step("stop", "a"),)).digest()
