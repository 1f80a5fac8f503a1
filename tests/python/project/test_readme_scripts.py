"""What README says of the scripts, as far as nothing has to be installed or built for it."""

import os
import re
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[3]
SCRIPTS = ROOT / "scripts"


def test_every_folder_of_tests_is_a_stage() -> None:
    stages = re.search(r"^readonly ALL_STAGES=\((.*)\)$", (SCRIPTS / "test").read_text("utf-8"), re.MULTILINE)
    assert stages is not None
    for tests in (ROOT / "tests", ROOT / "mauve_examples" / "tests"):
        folders = {file.relative_to(tests).parts[0] for file in tests.glob("*/**/test_*.*")}
        assert folders
        by_ctest = {"models", "rules"}  # all in the stage kernel
        assert folders <= {*stages[1].split(), *by_ctest}


def test_ci_runs_every_tool_and_every_test() -> None:
    """By scripts/test, which lets scripts/lint run beside its stages."""
    assert re.search(r"scripts/test\" all lint$", (ROOT / ".ci" / "run").read_text("utf-8"), re.MULTILINE)
    text = (SCRIPTS / "test").read_text("utf-8")
    assert re.search(r"scripts/lint(?! *-?\w)", text)
    assert re.search(r'all\) stages\+=\("\$\{ALL_STAGES\[@\]\}"\)', text)


def test_a_sourced_jazzy_is_found_and_wheels_are_not_taken_for_one(tmp_path: Path) -> None:
    copies = tmp_path / "clone" / "scripts"
    shutil.copytree(SCRIPTS, copies)
    without_start = (SCRIPTS / "setup").read_text("utf-8").removesuffix('main "$@"\n')
    (copies / "setup").write_text(f'{without_start}find_installed_jazzy; echo "[$jazzy]"\n', encoding="utf-8")
    jazzy, wheels = tmp_path / "jazzy", tmp_path / "wheels"
    for prefix in (jazzy, wheels):
        (prefix / "share" / "rclpy").mkdir(parents=True)
    (wheels / "pyvenv.cfg").touch()

    def found(distribution: str, *prefixes: Path) -> str:
        path = os.pathsep.join(str(prefix) for prefix in prefixes)
        environment = {**os.environ, "ROS_DISTRO": distribution, "AMENT_PREFIX_PATH": path}
        command = ["bash", str(copies / "setup")]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    assert found("jazzy", jazzy) == f"[{jazzy}]\n"
    assert found("jazzy", wheels, jazzy) == f"[{jazzy}]\n"
    assert found("jazzy", wheels) == "[]\n"
    assert found("humble", jazzy) == "[]\n"
