"""The files a mission's processes start from: one architecture and one rules file per robot."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mauve_examples import _mission
from mauve_examples.mission.demo_errors import BadInputError
from mauve_examples.mission.facts import MissionArea, MissionFacts, Pose, load_area
from mauve_rt.parts.ament_index import share_folder
from mauve_rt.yaml.text import read_yaml
from mauve_rt.yaml.writer import write_yaml

ROBOT, SUPERVISOR = "robot.yaml", "supervisor.yaml"


@dataclass(frozen=True)
class World:
    """The map a mission takes place in. Lengths in m."""

    map_file: Path
    radius_m: float
    starts: dict[str, Pose]
    area: MissionArea


@dataclass(frozen=True)
class RobotSetup:
    """What a robot's processes are started with."""

    name: str
    architecture: Path
    rules: Path | None  # None: no supervisor


def data_file(folder: str, name: str) -> Path:
    """A file of this package: installed under share/, beside the sources otherwise. It need not exist."""
    share = share_folder("mauve_examples")
    installed = share / folder / name if share is not None else None
    if installed is not None and installed.exists():
        return installed
    return Path(__file__).resolve().parents[1] / folder / name


def map_file(text: str) -> Path:
    """The map a user means: a file, or by its name one of the project's own.

    Raises:
        BadInputError: it looks like a name, but there is no map of that name.
    """
    if Path(text).suffix or "/" in text or Path(text).is_file():
        return Path(text).absolute()
    own = data_file("maps", f"{text}.yaml")
    if not own.exists():
        known = ", ".join(sorted(path.stem for path in own.parent.glob("*.yaml")))
        raise BadInputError(f"map {text}: neither a file nor a map of ours ({known})")
    return own


def load_world(map_file: Path, robots: Sequence[str], *, seed: int) -> World:
    """Read the map and place the robots.

    Raises:
        BadInputError: the map cannot be used, or has no room for so many robots.
    """
    radius_m = float(_template(ROBOT)["components"]["robot"]["properties"]["radius"])
    try:
        grid = _mission.load_map(str(map_file))
        poses = _mission.start_poses(grid, len(robots), seed)
        starts = dict(zip(robots, poses, strict=True))
        facts = MissionFacts(map_path=map_file, radius_m=radius_m, starts=starts, started_ns=0, ended_ns=0)
        return World(map_file=map_file, radius_m=radius_m, starts=starts, area=load_area(facts))
    except _mission.MapError as error:
        raise BadInputError(str(error)) from None


def write_setups(
    world: World, folder: Path, *, seed: int, supervisor: bool, hosts: bool = False
) -> list[RobotSetup]:
    """Write folder/architecture/NAME.yaml and folder/supervisor/NAME.yaml for every robot.

    With `hosts` there is no radio: each of two robots hears what the other one sends.
    """
    cpus = sorted(os.sched_getaffinity(0))
    setups = []
    for index, (name, pose) in enumerate(world.starts.items()):
        architecture = folder / "architecture" / f"{name}.yaml"
        changes = {"map": str(world.map_file), "seed": seed + index, "number": index + 1}
        changes |= dict(zip(("start_x", "start_y", "start_yaw"), pose, strict=True))
        peers = [peer for peer in world.starts if peer != name]
        cpu = cpus[index % len(cpus)]
        robot = _robot(name, peers=peers, cpu=cpu, properties=changes)
        if hosts:
            robot = _on_a_host(robot, peers[0])
        _write(architecture, ROBOT, robot)
        rules = folder / "supervisor" / f"{name}.yaml" if supervisor else None
        if rules is not None:
            given = _template(SUPERVISOR)
            _write(rules, SUPERVISOR, _hearing(given, peers[0]) if hosts else given)
        setups.append(RobotSetup(name=name, architecture=architecture, rules=rules))
    return setups


def _robot(name: str, *, peers: list[str], cpu: int, properties: Mapping[str, object]) -> Any:
    document = _template(ROBOT)
    document["executor"]["namespace"] = f"/{name}"
    document["executor"]["peers"] = peers
    for component in document["components"].values():
        component["cpus"] = [cpu]
        for key in component.get("properties", {}).keys() & properties.keys():
            component["properties"][key] = properties[key]
    return document


def heard_from(peer: str) -> str:
    """The topic by which a robot on a machine of its own hears a peer."""
    return f"/{peer}/radio/out"


def body_of(robot: str) -> str:
    """The topic by which such a robot tells the world where its body is."""
    return f"/{robot}/body"


def _on_a_host(document: Any, peer: str) -> Any:
    """The document with the topics that robots on machines of their own have."""
    document["resources"]["body"]["topic"]["name"] = "body"
    return _hearing(document, peer)


def _hearing(document: Any, peer: str) -> Any:
    """The document with what comes by radio coming from the peer, wherever it is named."""
    if isinstance(document, dict):
        return {key: _hearing(value, peer) for key, value in document.items()}
    if isinstance(document, list):
        return [_hearing(value, peer) for value in document]
    return heard_from(peer) if document == "radio/in" else document


def _template(name: str) -> Any:
    return read_yaml(data_file("architecture", name).read_text(encoding="utf-8"))


def _write(path: Path, template: str, document: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    origin = f"# Made for one mission from mauve_examples' architecture/{template}, which has the comments.\n"
    path.write_text(origin + write_yaml(document), encoding="utf-8")
