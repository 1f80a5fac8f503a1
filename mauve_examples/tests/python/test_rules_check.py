"""`mauve rules check` of the mission's rules: what docs/rules.md shows of it."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
MISSION = ROOT / "mauve_examples/architecture"


def test_the_bound_of_the_documentation() -> None:
    page = (ROOT / "docs/rules.md").read_text(encoding="utf-8")
    (bound,) = re.findall(r"```\n(link_lost .*?)```", page, re.DOTALL)
    rules, robot = str(MISSION / "supervisor.yaml"), str(MISSION / "robot.yaml")
    # In a process of its own: here other tests load packages with C++ types of their own for these messages.
    command = [sys.executable, "-m", "mauve_rt.cli", "rules", "check", rules, "--architecture", robot]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout.splitlines()[:-1] == bound.splitlines()
