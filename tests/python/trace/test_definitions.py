"""Message definitions are found as the ament index has them and read by others."""

from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mauve_rt.trace import TraceError
from mauve_rt.trace.format.definitions import SEPARATOR, find_definition

AddMessage = Callable[..., None]


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))

    def add(name: str, text: str, type_hash: str = "") -> None:
        path = tmp_path / "share" / f"{name}.msg"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        if type_hash:
            path.with_suffix(".json").write_text(
                f'{{"type_hashes": [{{"type_name": "{name}", "hash_string": "{type_hash}"}}]}}'
            )

    return add


def test_dependencies_follow_once_each_behind_separators(prefix: AddMessage):
    prefix("p/msg/A", "# first\nB[<=3] many\nq/C one\nstring<=5 text\nuint8 X=1 # B b\n", "RIHS01_a")
    prefix("p/msg/B", "q/C c\nfloat64[2] v\n")
    prefix("q/msg/C", "D d\n")
    prefix("q/msg/D", "bool ok\n")
    found = find_definition("p/msg/A")
    assert found.type_name == "p/msg/A"
    assert found.type_hash == "RIHS01_a"
    head, *others = found.text.split(SEPARATOR + "\n")
    assert head.startswith("# first\nB[<=3] many")
    assert [text.splitlines()[0] for text in others] == ["MSG: p/B", "MSG: q/C", "MSG: q/D"]


def test_the_text_is_enough_to_read_the_message(prefix: AddMessage):
    prefix("p/msg/A", "B[<=3] many\nint8[256] cells\nstring<=5 text\n")
    prefix("p/msg/B", "float64 x\n")
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(find_definition("p/msg/A").text, "p/msg/A"))
    assert set(store.types) >= {"p/msg/A", "p/msg/B"}


def test_a_type_without_a_hash_file_has_none(prefix: AddMessage):
    prefix("p/msg/A", "bool ok\n")
    assert find_definition("p/A").type_hash == ""


def test_a_part_of_an_action_is_a_section_of_its_file(prefix: AddMessage, tmp_path: Path):
    prefix("p/msg/B", "float64 x\n")
    prefix("p/action/Go", "", "RIHS01_g")
    (tmp_path / "share/p/action/Go.action").write_text("B to  # ---\n--- \n---\nint8 left\nB at\n")
    described = tmp_path / "share/p/action/Go.json"
    described.write_text(described.read_text().replace('"p/action/Go"', '"p/action/Go_Goal"'))
    goal = find_definition("p/action/Go_Goal")
    assert goal.type_hash == "RIHS01_g"
    assert goal.text == f"B to  # ---\n{SEPARATOR}\nMSG: p/B\nfloat64 x\n"
    assert find_definition("p/action/Go_Result").text == "\n"
    assert find_definition("p/action/Go_Feedback").text.startswith("int8 left\nB at\n====")
    (tmp_path / "share/p/action/Go.action").write_text("B to\n---\n")
    with pytest.raises(TraceError, match=r"Go\.action: expected 3 sections between lines of ---, found 2"):
        find_definition("p/action/Go_Goal")


def test_the_parts_of_an_installed_action_have_hashes_of_their_own():
    names = [f"mauve_msgs/action/DriveTo_{part}" for part in ("Goal", "Result", "Feedback")]
    hashes = {find_definition(name).type_hash for name in names}
    assert len(hashes) == len(names)
    assert all(one.startswith("RIHS01_") for one in hashes)


def test_a_missing_dependency_says_what_to_do(prefix: AddMessage):
    prefix("p/msg/A", "far/Away x\n")
    with pytest.raises(TraceError, match=r"far/msg/Away.*used by p/msg/A.*install or build the package far"):
        find_definition("p/msg/A")


@pytest.mark.parametrize("name", ["", "A", "p/srv/A", "p/msg/", "a/b/c/d", "p/action/A", "p/action/A_Part"])
def test_a_name_that_is_none_is_refused(name: str):
    with pytest.raises(TraceError, match="expected package/msg/Name"):
        find_definition(name)
