"""`mauve analyze --chain`: names, routes, bounds, what a bag shows, errors."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from synthetic_traces import EPOCH_NS, MS, deploy, record

from mauve_rt.cli.chain_routes import Wiring
from mauve_rt.cli.main import main
from mauve_rt.trace.recording.synthetic import SyntheticSource

Analyze = Callable[..., tuple[int, str, str]]

PARTS = "shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
CHAIN = f"""\
mauve: 1
executor: {{wakeup_us: 0, overhead_ns: 0, namespace: /robot}}
components:
  quick: {{{PARTS},
          priority: 40, cpus: [0], properties: {{period_ms: 10}}, states: {{Count: {{wcet_ns: 3000000}}}}}}
  slow: {{{PARTS},
         priority: 30, cpus: [1], properties: {{period_ms: 20}}, states: {{Count: {{wcet_ns: 5000000}}}}}}
resources:
  given: {{kind: latest_value, type: std_msgs/msg/Float64, topic: {{name: given, direction: subscribe}}}}
  between: {{kind: latest_value, type: std_msgs/msg/Float64}}
  result: {{kind: latest_value, type: std_msgs/msg/Float64}}
connections:
  - [quick.set, given.read]
  - [quick.count, between.write]
  - [slow.set, between.read]
  - [slow.count, result.write]
"""


@pytest.fixture
def analyze(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Analyze:
    """analyze(TEXT, WORD...): status, stdout, stderr of a file with that text."""

    def run(text: str, *words: str) -> tuple[int, str, str]:
        file = tmp_path / "robot.yaml"
        file.write_text(text, encoding="utf-8")
        status = main(["analyze", str(file), *words])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


BOTH = "at most 38.000 ms: quick 10.000 + 3.000 ms, slow 20.000 + 5.000 ms\n"


@pytest.mark.parametrize(
    "chain",
    [
        "given:result",
        "/robot/given:result",
        "quick:slow",
        "quick.set:slow.count",
        "quick.count:slow.set",
        "given:quick:slow:result",
        "given:between:result",
        "quick:between:slow.set:result",
    ],
)
def test_a_chain_from_each_kind_of_end(analyze: Analyze, chain: str) -> None:
    status, out, err = analyze(CHAIN, "--chain", chain)
    assert (status, err) == (0, "")
    assert f"\n{chain}: reaction at most 38.000 ms, data age {BOTH}" in out
    assert "  if each job of a member reads its input and then writes its output; " in out
    begins_at_topic = chain.startswith(("given:", "/robot/given:", "quick.set:"))
    assert ("  if no time passes on /robot/given: " in out) == begins_at_topic


def test_a_chain_of_resources_begins_at_the_reader(analyze: Analyze) -> None:
    _, out, _ = analyze(CHAIN, "--chain", "between:result", "--chain", "given:between")
    assert "\nbetween:result: reaction at most 25.000 ms, data age at most 25.000 ms: slow 20." in out
    assert "\ngiven:between: reaction at most 13.000 ms, data age at most 13.000 ms: quick 10." in out


def test_the_longest_of_several_routes_counts(analyze: Analyze) -> None:
    third = f"{PARTS}, priority: 35, cpus: [1], properties: {{period_ms: 30}}"
    third += ", states: {Count: {wcet_ns: 1000000}}"
    text = (
        CHAIN.replace("components:\n", f"components:\n  third: {{{third}}}\n")
        .replace("5000000", "4000000")
        .replace("result: {kind: latest_value", "result: {kind: shared_data, longest_hold_ns: 1000")
        .replace(
            "connections:\n", "connections:\n  - [third.set, given.read]\n  - [third.count, result.write]\n"
        )
    )
    status, out, err = analyze(text, "--chain", "given:result")
    assert err == ""
    assert status == 0
    assert f"\ngiven:result: reaction at most 38.000 ms, data age {BOTH}" in out
    assert (
        f"  given -> quick -> between -> slow -> result: reaction at most 38.000 ms, data age {BOTH}" in out
    )
    assert "  given -> third -> result: reaction at most 31.001 ms, " in out, "slow may hold the lock"
    _, out, _ = analyze(text, "--chain", "given:third:result")
    assert "\ngiven:third:result: reaction at most 31.001 ms, " in out, "that route alone"
    missing = text.replace(", states: {Count: {wcet_ns: 1000000}}", "")
    status, out, _ = analyze(missing, "--chain", "given:result", "--chain", "given:between")
    assert status == 3
    assert "\ngiven:result: not provable: no bound of reaction and data age\n  " in out
    assert "\n  third has no response bound: it is not provable\n" in out
    assert "\ngiven:between: reaction at most 13.000 ms" in out, "neither is in it"


def ports(**resources: str) -> list[SimpleNamespace]:
    """Of names as `read_scan`: its kind is in front."""
    return [
        SimpleNamespace(name=name, kind=name.partition("_")[0], service="", resource=resource)
        for name, resource in resources.items()
    ]


@pytest.mark.parametrize(
    ("chain", "routes"),
    [
        ("a:b", ["a -> x -> b", "a -> y -> b"]),
        ("a.write_y:b", ["a -> y -> b"]),
        ("a:b.read_x", ["a -> x -> b"]),
        ("a.read_in:b.write_out", ["in -> a -> x -> b -> out", "in -> a -> y -> b -> out"]),
        ("a:b.read_x:out", ["a -> x -> b -> out"]),
        ("in:a:x:b", ["in -> a -> x -> b"]),
        ("in:out", ["in -> a -> x -> b -> out", "in -> a -> y -> b -> out"]),
    ],
)
def test_a_port_chooses_the_way(chain: str, routes: list[str]) -> None:
    first = SimpleNamespace(name="a", ports=ports(read_in="in", write_x="x", write_y="y", read_back="out"))
    last = SimpleNamespace(name="b", ports=ports(read_x="x", read_y="y", write_out="out"))
    assert [str(route) for route in Wiring.of([first, last]).routes(chain)] == routes


FORM = "--chain: expected FROM:TO as scan:command, or each step of one route as scan:control:command"


@pytest.mark.parametrize(
    ("chain", "error"),
    [
        ("given", f"{FORM}, found given"),
        ("given:", f"{FORM}, found given:"),
        ("given::result", f"{FORM}, found given::result"),
        (
            "given:slow:result",
            "--chain given:slow:result: no data goes from given to result by these steps; see mauve graph",
        ),
        (
            "given:reslt",
            "--chain given:reslt: expected a component, a port, a resource or a topic, found reslt; ",
        ),
        (
            "result:given",
            "--chain result:given: no data goes from result to given; the data goes the other way: write ",
        ),
        (
            "quick:quick.set",
            "--chain quick:quick.set: expected two ends, found component quick as both; name another end",
        ),
        (
            "quick:given",
            "--chain quick:given: no data goes from quick to given; the data goes the other way: ",
        ),
    ],
)
def test_a_wrong_chain_is_refused(analyze: Analyze, chain: str, error: str) -> None:
    status, out, err = analyze(CHAIN, "--chain", chain)
    assert (status, out) == (2, "")
    assert err.startswith(f"mauve: {error}")


def test_a_queue_and_a_second_writer(analyze: Analyze) -> None:
    kind = "between: {kind: latest_value, type: std_msgs/msg/Float64"
    queue = "between: {kind: ring_buffer, capacity: 4, longest_hold_ns: 1000, type: std_msgs/msg/Float64"
    one_cpu = CHAIN.replace("cpus: [1]", "cpus: [0]")
    status, out, _ = analyze(one_cpu.replace(kind, f"{queue}, overwrite: true"), "--chain", "given:result")
    assert status == 0, out
    assert "slow 4 x 20.000 + " in out
    status, out, _ = analyze(one_cpu.replace(kind, queue), "--chain", "given:result")
    assert status == 3
    assert "  between refuses values when it is full: set overwrite to true\n" in out
    topic = f"{queue}, topic: {{name: other, direction: subscribe}}".replace(
        "ring_buffer, capacity: 4", "shared_data"
    )
    status, out, _ = analyze(one_cpu.replace(kind, topic), "--chain", "given:result")
    assert status == 3
    assert "  between has more writers (/robot/other): they may hide a value of the chain\n" in out


def recorded(folder: Path, *, slow_late_ns: int = 0) -> Path:
    """Twelve jobs of quick and six of slow, which run for 2 ms and 4 ms."""
    source = SyntheticSource(["quick", "slow"])
    for component, period_ns, took_ns in (("quick", 10 * MS, 2 * MS), ("slow", 20 * MS, 4 * MS)):
        deploy(source, component, period_ns=period_ns)
        instant_ns = EPOCH_NS
        while instant_ns < EPOCH_NS + 120 * MS:
            source.cycle(component, instant_ns, states={"Count": took_ns}, wait_ns=period_ns)
            instant_ns += period_ns
            if component == "slow" and slow_late_ns and instant_ns == EPOCH_NS + 40 * MS:
                instant_ns += slow_late_ns
    return record(source, folder)


def test_a_bag_shows_the_distribution(analyze: Analyze, tmp_path: Path) -> None:
    """A change at 0 ms comes to quick at 10 ms, to slow at 20 ms, and out at 24 ms; one at 10 ms at 44 ms."""
    bag = recorded(tmp_path / "bag")
    status, out, err = analyze(CHAIN, "--chain", "given:result", "--budget-from", str(bag))
    assert (status, err) == (0, "")
    assert (
        "    measured reaction: min 24.000 ms, median 24.000 ms, 99 % 34.000 ms, max 34.000 ms (n = 9)\n"
        in out
    )
    assert "    measured data age: min 34.000 ms, " in out


def test_a_bag_without_a_member_is_said(analyze: Analyze, tmp_path: Path) -> None:
    source = SyntheticSource(["quick"])
    deploy(source, "quick")
    bag = record(source, tmp_path / "bag")
    status, out, _ = analyze(CHAIN, "--chain", "given:result", "--budget-from", str(bag))
    assert status == 0
    assert "    not measured: component 'slow': not in the trace, which has quick\n" in out


def test_a_queue_is_not_in_the_measured_times(analyze: Analyze, tmp_path: Path) -> None:
    kind = "between: {kind: latest_value, type: std_msgs/msg/Float64"
    queue = kind.replace("latest_value", "ring_buffer, capacity: 4, overwrite: true, longest_hold_ns: 1000")
    text = CHAIN.replace("cpus: [1]", "cpus: [0]").replace(kind, queue)
    bag = recorded(tmp_path / "bag")
    _, out, _ = analyze(text, "--chain", "given:result", "--budget-from", str(bag))
    assert "    measured reaction: at least, without the time in a queue, min 24.000 ms, " in out


def test_a_chain_that_lasts_longer_than_its_bound_refutes_the_model(analyze: Analyze, tmp_path: Path) -> None:
    bag = recorded(tmp_path / "bag", slow_late_ns=20 * MS)
    status, out, _ = analyze(CHAIN, "--chain", "given:result", "--budget-from", str(bag))
    assert status == 5, out
    assert (
        "  model refuted: given -> quick -> between -> slow -> result: reaction of 54.000 ms measured, "
        "and its bound is 38.000 ms"
    ) in out
    assert "\nschedulable: " in out, "each response is within its bound: a release was not in time"


def test_chains_as_json(analyze: Analyze, tmp_path: Path) -> None:
    bag = recorded(tmp_path / "bag")
    status, out, _ = analyze(CHAIN, "--chain", "given:result", "--budget-from", str(bag), "--json")
    assert status == 0
    (chain,) = json.loads(out)["chains"]
    assert (chain["chain"], chain["outcome"]) == ("given:result", "schedulable")
    assert chain["reaction_ns"] == chain["data_age_ns"] == 38 * MS
    (route,) = chain["routes"]
    assert [term["component"] for term in route["terms"]] == ["quick", "slow"]
    assert route["measured"]["reaction"]["max_ns"] == 34 * MS
    assert "chains" not in json.loads(analyze(CHAIN, "--json")[1])
