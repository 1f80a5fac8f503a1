"""Requests and the memory of those already answered."""

from mauve_rt.node.executor_requests import Code, Outcome, Request, RequestLog, Step

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
