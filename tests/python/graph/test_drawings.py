"""Drawings: what they show, names of any characters, and layouts in which each text can be read."""

import random
import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from readable_drawings import checked_texts

from mauve_rt.graph.components import Measured, architecture_drawing
from mauve_rt.graph.dot import dot_text
from mauve_rt.graph.drawing import Drawing, Edge, Node, compared
from mauve_rt.graph.fsms import fsm_drawing
from mauve_rt.graph.look import CLASS_COLOURS, EDGE_COLOURS, NODE_LOOKS, colours, file_css
from mauve_rt.graph.mermaid import mermaid_text
from mauve_rt.graph.page import page_text
from mauve_rt.graph.svg import GraphError, svg_element, svg_text

NEEDS_DOT = pytest.mark.skipif(shutil.which("dot") is None, reason="no Graphviz")
FRAMES = {"frame": "odom", "child_frame": "base"}
HOSTILE = [
    'a"b',
    "</text><script>alert(1)</script>",
    "line\none",
    "back\\slash\\",
    "n\\n",
    "<b>",
    "&amp;",
    "\x00\x1b",
    "]]>",
    "#quot;",
]
NAMES = st.one_of(st.sampled_from(HOSTILE), st.text(max_size=60))


def port(name: str, kind: str, resource: str) -> SimpleNamespace:
    service = {"read": "read", "write": "write", "call": "get", "event": "read"}[kind]
    return SimpleNamespace(name=name, kind=kind, type="p/T", resource=resource, service=service)


def component(
    name: str, ports: Iterable[SimpleNamespace], *, cpus: tuple[int, ...] = (0,), **more: Any
) -> SimpleNamespace:
    facts = {
        "shell": "p/Shell",
        "core": "p/NavigationCore",
        "fsm": "p/Fsm",
        "period_ns": 5_000_000,
        "priority": 50,
    }
    return SimpleNamespace(name=name, ports=[*ports], cpus=cpus, **{**facts, **more})


def test_frames_of_ports_and_resources_are_drawn() -> None:
    pose = port("pose", "read", "pose")
    vars(pose).update(FRAMES)
    known = SimpleNamespace(name="pose", kind="shared_data", type="p/T", **FRAMES)
    drawing = architecture_drawing("robot", [component("control", [pose])], [known])
    assert [node.lines for node in drawing.nodes if node.kind == "resource"] == [("pose", "in odom, of base")]
    assert [edge.lines for edge in drawing.edges] == [("in odom, of base",)]


def ring(count: int) -> Iterator[SimpleNamespace]:
    """Each writes what the next one reads, and all call one resource."""
    for index in range(count):
        ports = [port("out", "write", f"data_{index}"), port("in", "read", f"data_{(index - 1) % count}")]
        yield component(f"component_{index}", [*ports, port("map", "call", "map")], cpus=(index % 4,))


def star(count: int) -> Iterator[SimpleNamespace]:
    """All read one resource."""
    for index in range(count):
        yield component(f"listener_{index}", [port("position", "read", "pose")], cpus=(index % 2,))


def lonely(count: int) -> Iterator[SimpleNamespace]:
    """No component is connected."""
    for index in range(count):
        yield component(f"component_{index}", [port("in", "read", "")], cpus=())


def layered(count: int, seed: int) -> Iterator[SimpleNamespace]:
    """From sensors to drivers in six layers; each reads one or two signals of the layer before."""
    chosen, wide = random.Random(seed), count // 6  # noqa: S311 - no secret
    for index in range(count):
        before = range(max(index // wide - 1, 0) * wide, index // wide * wide)
        inputs = chosen.sample(before, min(len(before), chosen.randint(1, 2)))
        ports = [port(f"input_{number}", "read", f"signal_{one}") for number, one in enumerate(inputs)]
        yield component(
            f"component_{index:02}",
            [*ports, port("output", "write", f"signal_{index}")],
            cpus=(index // wide % 4,),
        )


SHAPES = {
    "ring": [*ring(30)],
    "star": [*star(30)],
    "lonely": [*lonely(30)],
    **{f"layered {seed}": [*layered(30, seed)] for seed in range(4)},
}


@NEEDS_DOT
@pytest.mark.parametrize("shape", SHAPES)
def test_thirty_components_are_narrow_and_no_two_labels_overlap(shape: str) -> None:
    texts = checked_texts(svg_text(architecture_drawing(shape, SHAPES[shape])))
    assert {one.name for one in SHAPES[shape]} <= set(texts)


def test_a_component_has_its_rate_its_cpus_and_its_load() -> None:
    parts = [
        component("control", [port("in", "read", "")], cpus=(1, 0)),
        component("relay", [], period_ns=0, cpus=()),
        component("unknown", [], period_ns=None, priority=0, cpus=None),
    ]
    load = {"control": Measured(0.9, "90 %"), "relay": Measured(0.1, "10 %")}
    control, relay, unknown = architecture_drawing("a", parts, measured=load).nodes
    assert control.lines == (
        "control",
        "NavigationCore",
        "5 ms, priority 50",
        "load 90 %",
        "not connected: in",
    )
    assert (control.cluster, control.classes) == ("CPU 0, 1", ("high",))
    assert (relay.lines[2], relay.cluster, relay.classes) == ("on events, priority 50", "any CPU", ())
    assert (unknown.lines, unknown.cluster) == (("unknown", "NavigationCore"), "")


def test_arrows_follow_the_data_and_have_the_names_of_ports() -> None:
    ports = [port("pose", "read", "pose"), port("map_get", "call", "map"), port("out", "write", "command")]
    drawing = architecture_drawing("a", [component("control", [*ports, port("again", "read", "pose")])])
    assert [(one.start, one.end, one.lines) for one in drawing.edges] == [
        ("resource pose", "component control", ("again",)),
        ("resource map", "component control", ("map_get",)),
        ("component control", "resource command", ("out",)),
    ]
    assert drawing.edges[0].tip.splitlines() == [
        "control.pose (read), pose.read, p/T",
        "control.again (read), pose.read, p/T",
    ]


def test_ros_names_stand_at_their_resource() -> None:
    told = SimpleNamespace(
        name="pose", kind="shared_data", type="p/T", publishes="/robot/pose", subscribes=""
    )
    (node,) = architecture_drawing("a", [], [told]).nodes
    assert node.lines == ("pose", "publishes /robot/pose")


def test_differences_of_two_drawings_are_marked() -> None:
    def drawing(core: str, resource: str, properties: list[str]) -> Drawing:
        one = component("control", [port("in", "read", resource)], core=core, properties=properties)
        return architecture_drawing("a", [one, component("same", [])])

    found = compared(drawing("p/A", "old", ["gain=1"]), drawing("p/B", "new", ["gain=2"]))
    classes = {node.key: node.classes for node in found.nodes}
    assert classes == {
        "component control": ("changed",),
        "component same": (),
        "resource new": ("added",),
        "resource old": ("removed",),
    }
    assert found.nodes[0].lines == (
        "control",
        "A \N{RIGHTWARDS ARROW} B",
        "5 ms, priority 50",
        "gain 1 \N{RIGHTWARDS ARROW} 2",
    )
    assert [(edge.start, edge.classes) for edge in found.edges] == [
        ("resource new", ("added",)),
        ("resource old", ("removed",)),
    ]


def test_equal_drawings_have_no_difference() -> None:
    drawing = architecture_drawing("a", ring(3))
    assert compared(drawing, architecture_drawing("a", ring(3))) == drawing


def state(name: str, successors: list[str], **more: Any) -> SimpleNamespace:
    facts = {"is_initial": False, "is_wait": False, "is_event_wait": False, "duration_ns": 0, "wcet_ns": 0}
    return SimpleNamespace(name=name, successors=successors, **{**facts, "min_interarrival_ns": 0, **more})


def test_waits_have_their_times_and_arrows_their_guards() -> None:
    states = [
        state("Idle", ["Work", "Rest"], is_initial=True, action="look", guards=["has_work"], wcet_ns=2_000),
        state("Work", ["Rest"], action="work", guards=[]),
        state("Rest", ["Idle"], is_wait=True, duration_ns=10_000_000, duration_text="2 * unit_ms"),
        state(
            *("Event", ["Idle"]), is_wait=True, is_event_wait=True, event_port="goal", duration_ns=2**63 - 1,
            min_interarrival_ns=5_000_000,
        ),
        state("End", [], is_wait=True, duration_ns=2**63 - 1),
    ]  # fmt: skip
    drawing = fsm_drawing("f", states)
    assert [node.lines for node in drawing.nodes] == [
        *((), ("Idle", "look", "wcet 2 us"), ("Work", "work"), ("Rest", "2 * unit_ms", "10 ms")),
        *(("Event", "event goal", "at most every 5 ms"), ("End", "forever")),
    ]
    assert [node.kind for node in drawing.nodes] == [
        "start",
        "execution",
        "execution",
        "wait",
        "wait",
        "wait",
    ]
    assert [(edge.start[6:], edge.end[6:], edge.lines) for edge in drawing.edges[1:]] == [
        *(("Idle", "Work", ("has_work",)), ("Idle", "Rest", ("else",)), ("Work", "Rest", ())),
        *(("Rest", "Idle", ()), ("Event", "Idle", ())),
    ]


def test_two_opposite_arrows_do_not_lie_on_each_other() -> None:
    states = [state("A", ["B", "C"], is_initial=True), state("B", ["A"]), state("C", ["B"])]
    lines = dot_text(fsm_drawing("f", states)).splitlines()
    apart = [line.split("[")[0].strip() for line in lines if "tailport" in line]
    assert apart == ["n2 -> n1"], "start is n0, A is n1, B is n2"


def test_each_look_has_a_colour_in_light_and_in_dark() -> None:
    names = {*EDGE_COLOURS.values(), *CLASS_COLOURS.values()}
    names |= {name for look in NODE_LOOKS.values() for name in (look.fill, look.stroke)}
    for name in names:
        light, dark = colours()[name]
        assert light != dark
        assert file_css().count(f"--{name}: ") == 2
    assert "prefers-color-scheme: dark" in file_css()


def hostile_drawing(names: list[str]) -> Drawing:
    keys = [f"k{index}" for index in range(len(names))]
    nodes = [
        Node(key=key, kind=kind, lines=(name, name), cluster=name, tip=name)
        for key, name, kind in zip(keys, names, [*NODE_LOOKS] * len(names), strict=False)
    ]
    edges = [Edge(start=keys[0], end=keys[-1], kind="data", lines=(name,), tip=name) for name in names]
    return Drawing(title=names[0], nodes=tuple(nodes), edges=tuple(edges))


@NEEDS_DOT
@settings(max_examples=25, deadline=None)
@given(st.lists(NAMES, min_size=1, max_size=4))
def test_any_name_is_a_text_of_the_drawing_and_nothing_else(names: list[str]) -> None:
    drawing = hostile_drawing(names)
    root = ET.fromstring(svg_text(drawing))  # noqa: S314 - our own
    tags = {one.tag.rpartition("}")[2] for one in root.iter()}
    assert tags <= {"svg", "style", "g", "title", "text", "path", "polygon", "polyline", "ellipse"}
    groups = [one.get("class", "").split()[0] for one in root.iter("{http://www.w3.org/2000/svg}g")]
    assert (groups.count("node"), groups.count("edge")) == (len(names), len(names))
    assert "<script" not in page_text(drawing)
    assert not re.search(r"(?:src|href)=|@import|url\(|https?://", page_text(drawing))


@given(st.lists(NAMES, min_size=1, max_size=4))
def test_any_name_stays_within_its_label_of_mermaid(names: list[str]) -> None:
    lines = mermaid_text(hostile_drawing(names)).splitlines()
    assert lines[0] == "flowchart TB"
    for line in lines:
        assert line.count('"') in (0, 2)
        inside = re.sub(r'"[^"]*"', '""', line)
        assert re.fullmatch(r"[\w ():;,.#{}|\[\]<>=/-]*\"?\"?[\w ():;,.#{}|\[\]<>=/-]*", inside), line
        for text in re.findall('"([^"]*)"', line):
            assert not re.search(r"[<>&`*\[\]{}|]", text.replace("<br/>", ""))


@NEEDS_DOT
@pytest.mark.parametrize("name", HOSTILE)
def test_dot_reads_a_name_as_it_is(name: str) -> None:
    done = subprocess.run(
        ["dot", "-Tplain"],
        input=dot_text(hostile_drawing([name])),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0
    assert "syntax error" not in done.stderr


def test_without_graphviz_the_error_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(GraphError, match="apt-get install graphviz"):
        svg_text(architecture_drawing("a", ring(2)))
    assert dot_text(architecture_drawing("a", ring(2))).startswith('digraph "a" {')


def test_an_error_of_graphviz_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "dot"
    program.write_text("#!/bin/sh\necho 'no such library' >&2\nexit 1\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(GraphError, match=r"no such library\. Reinstall it"):
        svg_text(architecture_drawing("a", ring(2)))


@NEEDS_DOT
def test_an_element_of_a_page_has_tips_and_no_address() -> None:
    element = svg_element(architecture_drawing("a", ring(3)))
    assert 'data-tip="component_0' in element
    assert "<title>" not in element
    assert "http" not in element
