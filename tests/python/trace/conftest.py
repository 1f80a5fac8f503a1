"""What tests of bags share."""

from pathlib import Path

import pytest


@pytest.fixture
def test_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The messages of mauve_test_msgs are installed, and no others."""
    share = tmp_path / "prefix" / "share" / "mauve_test_msgs" / "msg"
    share.mkdir(parents=True)
    (share / "Text.msg").write_text("string data\n")
    (share / "Number.msg").write_text("uint32 data\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
