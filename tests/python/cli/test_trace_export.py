"""`mauve trace export` of real bags: files, refusals, exit status."""

import csv
import os
import shutil
from pathlib import Path

import pytest
from perfetto_decoding import Decoded

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag

TABLES = {
    "components",
    "contention",
    "decisions",
    "deployments",
    "marks",
    "output_curves",
    "overruns",
    "reconfigurations",
    "records",
    "releases",
    "services",
    "shadows",
    "states",
    "statistics",
}


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    share = tmp_path / "prefix" / "share"
    shutil.copytree(Path(__file__).parents[3] / "mauve_msgs" / "msg", share / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


def make_bag(name: str, *, state: str = "sense", realtime_offset_ns: int = 10**18) -> str:
    source = SyntheticSource(["control"], realtime_offset_ns=realtime_offset_ns)
    source.add("control", Kind.DEPLOYMENT, 10, a=1000, c=5000)
    source.add("control", Kind.START, 20, a=1000)
    source.cycle("control", 1000, states={state: 300}, wait_ns=5000, wakeup_ns=40)
    bag = TraceBag(source, Path.cwd().parent / name, node_name="/robot/executor", on_error=pytest.fail)
    bag.write(source.drain_trace(), [], whole=True)
    bag.close()
    return str(bag.directory)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_perfetto_is_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trace", "export", make_bag("bag")]) == 0
    assert capsys.readouterr() == ("bag.pftrace\n", "")
    sensed = [
        event for event in Decoded(Path("bag.pftrace")).of("control", parent="bag") if event.name == "sense"
    ]
    assert [(event.begin_ns, event.end_ns) for event in sensed] == [(1040, 1340)]


def test_values_of_a_bag_are_counters() -> None:
    sample = Path(__file__).parents[3] / "docs/sample/metronome"
    assert main(["trace", "export", str(sample)]) == 0
    decoded = Decoded(Path("metronome.pftrace"))
    beats = decoded.counted[decoded.uuid("/beat.data")]
    assert [value for _, value in beats] == [*map(float, range(1, 32)), 0.0]
    assert [time_ns for time_ns, _ in beats] == mauve_rt.trace.open(sample).values[
        "/beat.data"
    ].index.tolist()


def test_csv(capsys: pytest.CaptureFixture[str]) -> None:
    state = 'say "hi", \n=1+1;\N{SNOWMAN}'
    assert main(["trace", "export", make_bag("bag", state=state), "--format", "csv"]) == 0
    assert capsys.readouterr().out == "bag_csv\n"
    folder = Path("bag_csv")
    assert {file.name for file in folder.iterdir()} == {f"{name}.csv" for name in TABLES}
    assert table(folder / "states.csv") == [
        {"component": "control", "state": state, "begin_ns": "1040", "end_ns": "1340", "execution_ns": "300"}
    ]
    (release,) = table(folder / "releases.csv")
    assert (release["nominal_ns"], release["wakeup_ns"], release["phase_error_ns"]) == ("1000", "40", "40")
    assert [row["kind"] for row in table(folder / "records.csv")][:3] == ["deployment", "start", "release"]
    assert {(row["figure"], row["of"], row["max_ns"]) for row in table(folder / "statistics.csv")} >= {
        ("wakeup", "", "40"),
        ("response", "", "340"),
        ("execution", state, "300"),
    }
    assert table(folder / "components.csv")[0]["releases"] == "1"


def test_several_bags_are_one_trace() -> None:
    bags = [make_bag("robot_1"), make_bag("robot_2")]
    assert main(["trace", "export", *bags, "--out", "both.pftrace"]) == 0
    decoded = Decoded(Path("both.pftrace"))
    assert [decoded.of("control", parent=name) != [] for name in ("robot_1", "robot_2")] == [True, True]
    assert main(["trace", "export", *bags, "--format", "csv"]) == 0
    assert {row["component"] for row in table(Path("traces_csv/states.csv"))} == {
        "robot_1/control",
        "robot_2/control",
    }


def test_what_is_there_stays_unless_forced(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = make_bag("bag")
    for out, words in ((Path("a"), []), (Path("b"), ["--format", "csv"])):
        command = ["trace", "export", bag, "--out", str(out), *words]
        assert main(command) == 0
        assert main(command) == 2
        assert "exists already; remove it, replace it by --force" in capsys.readouterr().err
        if out.is_dir():
            (out / "mine.txt").write_text("stays", encoding="utf-8")
            (out / "states.csv").write_text("goes", encoding="utf-8")
        assert main([*command, "--force"]) == 0
    monkeypatch.chdir("b")
    assert main(["trace", "export", bag, "--format", "csv", "--out", ".", "--force"]) == 0
    monkeypatch.chdir("..")
    assert Path("b/mine.txt").read_text(encoding="utf-8") == "stays"
    assert len(table(Path("b/states.csv"))) == 1


def test_what_cannot_be_exported_is_said_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    (Path.cwd() / "empty").mkdir()
    bag = make_bag("bag")
    elsewhere = make_bag("elsewhere", realtime_offset_ns=2 * 10**18)
    for words, expected in (
        ([str(Path.cwd() / "empty")], "no .mcap file in it"),
        (["missing"], "not there"),
        ([bag, "--out", "nowhere/x"], "nowhere/x: cannot be written (No such file or directory)"),
        ([bag, "--format", "csv", "--out", "nowhere/x"], "nowhere/x: cannot be written"),
        ([bag, "--out", "x" * 300], "cannot be written (File name too long)"),
        ([bag, "--format", "csv", "--out", "/", "--force"], "/: a folder of this name exists already"),
        ([bag, bag], "another one is named bag, too"),
        ([bag, elsewhere], "different monotonic clocks"),
    ):
        assert main(["trace", "export", *words]) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert expected in captured.err
        assert captured.err.count("\n") == 1
    assert [file.name for file in Path.cwd().iterdir()] == ["empty"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written(capsys: pytest.CaptureFixture[str]) -> None:
    bag = make_bag("bag")
    Path.cwd().chmod(0o500)
    assert main(["trace", "export", bag]) == 2
    assert "Permission denied" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["trace"], ["trace", "exprot"], ["trace", "export"], ["trace", "export", "--format", "x"]]
)
def test_bad_usage(words: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
