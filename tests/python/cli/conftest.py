"""What the tests of commands share."""

from pathlib import Path

import pytest
from checked_rules import Check

from mauve_rt.cli.main import main


@pytest.fixture
def check(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Check:
    """check(*rules, robot=TEXT): status, lines of stdout and of stderr, without the folder's name."""

    def run(*rules: str, robot: str = "") -> tuple[int, list[str], list[str]]:
        file, architecture = tmp_path / "rules", tmp_path / "robot"
        file.write_text("mauve: 1\nrules:\n" + "".join(rules), encoding="utf-8")
        architecture.write_text(robot, encoding="utf-8")
        beside = ["--architecture", str(architecture)] if robot else []
        status = main(["rules", "check", str(file), *beside])
        said = capsys.readouterr()
        out, err = (text.replace(f"{tmp_path}/", "").splitlines() for text in (said.out, said.err))
        return status, out, err

    return run
