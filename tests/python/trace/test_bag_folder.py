"""A bag is what its metadata names: other files in its folder are not read, and `trace check` names them."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader
from synthetic_traces import record_small_bag

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace.bag.disk import METADATA
from mauve_rt.trace.bag.files import own_and_other_files
from mauve_rt.trace.bag.snapshot import snapshot_bag


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return record_small_bag(tmp_path / "run")


def _records(bag: Path) -> int:
    return sum(len(rows) for rows in mauve_rt.trace.open(bag).records.values())


@pytest.mark.parametrize("name", ["compressed.mcap", "other_0.mcap", "run_2.mcap", "a_run_0.mcap"])
def test_a_file_that_metadata_does_not_name_is_not_read(
    bag: Path, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = _records(bag)
    [own], _ = own_and_other_files(bag)
    shutil.copy(own, bag / name)
    with Reader(bag) as reader:
        assert reader.message_count > 0, "others read what metadata names"
    assert own_and_other_files(bag) == ([own], [bag / name])
    assert _records(bag) == alone
    capsys.readouterr()
    assert main(["trace", "check", str(bag)]) == 0
    assert f"note: {name}: no file of this bag: metadata.yaml does not name it" in capsys.readouterr().out
    assert main(["trace", "repair", str(bag)]) == 0
    assert (bag / name).exists()
    assert [file.path.name for file in snapshot_bag(bag, tmp_path / "copy").files] == [own.name]


def test_a_file_that_its_recorder_had_begun_is_read(bag: Path) -> None:
    """Killed in a split, before metadata.yaml named it."""
    [own], _ = own_and_other_files(bag)
    shutil.copy(own, bag / "run_1.mcap")
    files, others = own_and_other_files(bag)
    assert ([file.name for file in files], others) == (["run_0.mcap", "run_1.mcap"], [])


@pytest.mark.parametrize("names", [None, ["gone.mcap"]])
def test_without_a_name_of_what_is_there_all_files_are_read(bag: Path, names: list[str] | None) -> None:
    metadata = bag / METADATA
    if names is None:
        metadata.unlink()
    else:
        metadata.write_text(
            json.dumps({"rosbag2_bagfile_information": {"relative_file_paths": names}}), "utf-8"
        )
    shutil.copy(bag / "run_0.mcap", bag / "x.mcap")
    files, others = own_and_other_files(bag)
    assert (len(files), others) == (2, [])


def test_a_command_that_reads_no_bag_loads_no_yaml() -> None:
    """25 ms of each command."""
    code = (
        "import sys; from mauve_rt.cli.main import build_parser; build_parser(); print('yaml' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
