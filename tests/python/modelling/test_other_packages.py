"""Parts of another package's model: where they are found, what they become, and what is refused."""

from pathlib import Path

import pytest
from arm_model import arm

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.modelling.generate import generated, interfaces, python_module
from mauve_rt.modelling.loading import ModelLoader
from mauve_rt.modelling.package_model import PackageModel

GUIDANCE = Path(__file__).with_name("guidance.yaml")
ARM = arm('{at: "my_robot/Point2D[<=4]"}')
THIRD = """\
mauve_model: 1
package: my_third
fsms:
  EagerFsm:
    core: my_arm/Follower
    initial: Follow
    states: {Follow: {run: follow, next: Rest}, Rest: {wait: 3 * unit_ms, next: Follow}}
"""


def load(tmp_path: Path, text: str, *others: str | Path) -> PackageModel:
    path = tmp_path / "model.yaml"
    path.write_text(text, encoding="utf-8")
    files = []
    for number, other in enumerate(others):
        files.append(other if isinstance(other, Path) else tmp_path / f"other_{number}.yaml")
        if isinstance(other, str):
            files[-1].write_text(other, encoding="utf-8")
    return ModelLoader(files).load(path)


def refused(tmp_path: Path, text: str, *others: str | Path) -> str:
    with pytest.raises(ArchitectureFileError) as caught:
        load(tmp_path, text, *others)
    return "\n".join(caught.value.lines())


def installed(monkeypatch: pytest.MonkeyPatch, prefix: Path, package: str, model: str) -> None:
    share = prefix / "share" / package
    share.mkdir(parents=True)
    if model:
        (share / "model.yaml").write_text(model, encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))


def test_parts_of_another_model_become_code_that_names_its_package(tmp_path: Path) -> None:
    model = load(tmp_path, ARM, GUIDANCE)
    files = generated(model)
    assert files["msg/Reach.msg"].endswith("\nmy_robot/Point2D[<=4] at\n")
    fsm = files["include/my_arm/model/slow_guidance_fsm.hpp"]
    assert "#include <my_robot/model/guidance_core.hpp>\n" in fsm
    assert "mauve::Fsm<::my_robot::GuidanceShell, ::my_robot::GuidanceCore>" in fsm
    core = files["include/my_arm/model/follower_core.hpp"]
    assert "#include <my_robot/model/guidance_shell.hpp>\n" in core
    assert "mauve::Core<::my_robot::GuidanceShell>" in core
    assert 'registry.core<Eager>("my_arm/Eager", "my_robot/GuidanceShell"' in files["src/plugins.cpp"]
    assert interfaces(model) == ["my_robot/msg/Path", "my_robot/msg/Point2D"]
    module = python_module(model)
    assert "import my_robot_parts.model\n" in module
    assert "class SlowGuidanceFsm(api.Fsm[my_robot_parts.model.GuidanceShell, " in module


def test_a_model_uses_parts_through_another_model(tmp_path: Path) -> None:
    """The wait is three times a property of the third package's shell."""
    model = load(tmp_path, THIRD, ARM, GUIDANCE)
    assert [one.package for one in model.closure()] == ["my_robot", "my_arm"]
    assert model.core_of(model.content.fsms["EagerFsm"]).shell == "my_robot/GuidanceShell"


def test_the_model_of_an_installed_package_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, tmp_path / "prefix", "my_robot", GUIDANCE.read_text(encoding="utf-8"))
    assert load(tmp_path, ARM).used["my_robot"].path == tmp_path / "prefix/share/my_robot/model.yaml"


def test_a_given_model_goes_before_the_installed_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, tmp_path / "prefix", "my_robot", "mauve_model: 1\npackage: my_robot\n")
    assert load(tmp_path, ARM, GUIDANCE).used["my_robot"].path == GUIDANCE


def test_an_unknown_package_is_refused_at_its_place(tmp_path: Path) -> None:
    text = ARM.replace("core: my_robot/Guidance\n", "core: my_robt/Guidance\n")
    told = refused(tmp_path, text, GUIDANCE)
    assert "model.yaml:28:11: package 'my_robt' is not found; did you mean my_robot?" in told


def test_a_package_without_a_model_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, tmp_path / "prefix", "my_robot", "")
    told = refused(tmp_path, ARM)
    assert "model.yaml:4:15: package 'my_robot' has no model: expected share/my_robot/model.yaml" in told
    assert told.endswith("of a message write my_robot/msg/Point2D")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (
            "shell: my_robot/GuidanceShell",
            "shell: my_robot/GuidanceShel",
            "15:12: package 'my_robot' has no shell 'GuidanceShel' in its model; did you mean GuidanceShell?",
        ),
        (
            "core: my_robot/Guidance\n",
            "core: my_robot/Guidence\n",
            "has no core 'Guidence' in its model; did",
        ),
        (
            "write: my_robot/Point2D",
            "write: my_robot/Pont2D",
            "7:49: package 'my_robot' has no type 'Pont2D'",
        ),
        (
            "run: compute_path",
            "run: compute",
            "core 'my_robot/Guidance' has no action 'compute'; did you mean",
        ),
        ("wait: 5 * unit_ms", "wait: 5 * unit", "there is no property 'unit'; did you mean unit_ms?"),
        ("read: Reach", "read: my_arm/Reach", "package 'my_arm' is the one of this model; write Reach"),
    ],
)
def test_what_the_other_model_lacks_is_refused_at_its_place(
    tmp_path: Path, before: str, after: str, told: str
) -> None:
    assert before in ARM
    found = refused(tmp_path, ARM.replace(before, after), GUIDANCE)
    assert told in found, found


def test_models_that_use_each_other_are_refused(tmp_path: Path) -> None:
    robot = GUIDANCE.read_text(encoding="utf-8").replace(
        "goal: {read: Point2D}", "goal: {read: my_arm/Reach}"
    )
    told = refused(tmp_path, ARM, robot)
    assert "other_0.yaml:14:20: models use each other: my_arm -> my_robot -> my_arm; move the parts" in told


def test_a_message_has_no_field_that_exists_in_cpp_only(tmp_path: Path) -> None:
    text = ARM.replace(
        "types:\n", "types:\n  Pose: {cpp: 'a::Pose', include: a/pose.hpp, name: geometry_msgs/msg/Pose}\n"
    )
    told = refused(tmp_path, text.replace('"my_robot/Point2D[<=4]"', "Pose"), GUIDANCE)
    assert (
        "a message has no field of 'Pose', a struct that exists in C++; write geometry_msgs/msg/Pose" in told
    )
