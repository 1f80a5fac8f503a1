"""The models of the lock-free protocols in tests/models/loom: each holds, and each weakened twin fails."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
MANIFEST = ROOT / "tests" / "models" / "loom" / "Cargo.toml"


def _cargo(*words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "CARGO_TARGET_DIR": str(ROOT / "build" / "loom")}
    command = ["cargo", *words, "--locked", "--manifest-path", str(MANIFEST)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.skipif(shutil.which("cargo") is None, reason="cargo is not installed")
def test_each_model_holds_and_each_weakened_twin_fails() -> None:
    fetched = _cargo("fetch")
    if fetched.returncode != 0:
        error = next(
            (line for line in fetched.stderr.splitlines() if line.startswith("error")), "no reason given"
        )
        pytest.skip(f"the crates cannot be downloaded: {error}")
    tested = _cargo("test", "--release")
    assert tested.returncode == 0, tested.stdout + tested.stderr
