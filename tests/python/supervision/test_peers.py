"""What is known of another executor, by what is heard of it."""

import pytest

from mauve_rt._kernel import RuleEngine, RuleSpec, WhenSpec
from mauve_rt.supervision.peers import GONE_AFTER_NS, PEER_STATES, Peer, executor_name

S = 1_000_000_000


def test_it_is_unheard_until_something_is_heard():
    peer = Peer()
    peer.lost()
    assert peer.state(100 * S) == "unheard"
    assert peer.due_ns() is None


def test_it_is_gone_when_nothing_is_heard_any_more_and_there_again():
    peer = Peer()
    peer.tell(10 * S, "one", faulted=False)
    assert peer.state(10 * S + GONE_AFTER_NS) == "there"
    assert peer.due_ns() == 10 * S + GONE_AFTER_NS + 1
    assert peer.state(10 * S + GONE_AFTER_NS + 1) == "gone"
    peer.alive(20 * S)
    assert peer.state(20 * S) == "there"


def test_the_middleware_only_makes_it_faster():
    peer = Peer()
    peer.tell(10 * S, "one", faulted=False)
    peer.lost()
    assert peer.state(10 * S) == "gone"
    assert peer.due_ns() is None
    peer.tell(11 * S, "one", faulted=False)
    assert peer.state(11 * S) == "there"


def test_another_instance_and_a_faulted_component():
    peer = Peer()
    peer.tell(1 * S, "one", faulted=True)
    assert peer.state(1 * S) == "faulted"
    peer.tell(2 * S, "two", faulted=False)
    assert peer.state(2 * S) == "another_instance"


@pytest.mark.parametrize("state", PEER_STATES)
def test_the_engine_counts_them_in_this_order(state: str):
    engine = RuleEngine([RuleSpec("one", WhenSpec("peer", parameters={"executor": "b", "is": state}))])
    engine.arm(0)
    for number, told in enumerate(PEER_STATES):
        engine.tell(0, number + 1, float(number))
        engine.step(number + 1)
        assert engine.status(0).holds is (told == state)


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("robot_2", "/robot_2/executor"),
        ("/robot_2", "/robot_2/executor"),
        ("/robot_2/executor", "/robot_2/executor"),
        ("/", "/executor"),
        ("fleet/robot_2/executor", "/fleet/robot_2/executor"),
    ],
)
def test_an_executor_is_named_by_its_namespace_or_in_full(said: str, name: str):
    assert executor_name(said) == name
