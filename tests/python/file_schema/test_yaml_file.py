"""How a file is read that a request names: it may keep its reader waiting."""

import errno
import os
import resource
import threading
from pathlib import Path

import pytest

from mauve_rt.errors import ArchitectureFileError, internal_error_text
from mauve_rt.file_schema import yaml_file
from mauve_rt.file_schema.yaml_file import YamlFile


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "some.yaml"
    path.write_text("mauve: 1\n", encoding="utf-8")
    return path


def test_a_disk_that_hangs_is_not_waited_for(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = threading.Event()

    def hang(self: YamlFile) -> bytes:
        answer.wait()
        return b"mauve: 1\n"

    monkeypatch.setattr(yaml_file, "READ_TIMEOUT_S", 0.05)
    monkeypatch.setattr(YamlFile, "_read_bytes", hang)
    with pytest.raises(ArchitectureFileError, match=r"cannot read the file: it was not read within 0\.05 s"):
        YamlFile(file, waits=False)
    answer.set()


@pytest.mark.parametrize("waits", [False, True])
def test_the_reason_of_the_system_is_told(tmp_path: Path, file: Path, waits: bool) -> None:  # noqa: FBT001
    assert YamlFile(file, waits=waits).data == {"mauve": 1}
    with pytest.raises(ArchitectureFileError, match="No such file or directory"):
        YamlFile(tmp_path / "none.yaml", waits=waits)


def test_what_the_system_lacks_is_no_internal_error() -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    highest = os.open("/dev/null", os.O_RDONLY)
    resource.setrlimit(resource.RLIMIT_NOFILE, (highest, before[1]))
    try:
        with pytest.raises(OSError, match="Too many") as found:
            os.open("/dev/null", os.O_RDONLY)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
        os.close(highest)
    assert found.value.errno == errno.EMFILE
    text = internal_error_text(found.value)
    assert text.startswith("no file descriptor is left")
    assert "ulimit -n" in text
    assert internal_error_text(ValueError("odd")) == "internal error: ValueError: odd"
