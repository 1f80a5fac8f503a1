"""A bag is read, checked, measured, exported and shown where there is neither the native library nor ROS."""

import subprocess
import sys
from pathlib import Path

from synthetic_traces import record_small_bag

import mauve_rt

PROGRAM = """
import sys

for name in ("mauve_rt._kernel", "mauve_rt._bridge", "mauve_msgs", "rclpy", "std_msgs", "builtin_interfaces"):
    sys.modules[name] = None  # an import of it fails

from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import mauve_rt.trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.statistics import all_statistics
from mauve_rt.trace.report import write_report

bag, page, tables = map(Path, sys.argv[1:])
for module in walk_packages(mauve_rt.trace.__path__, "mauve_rt.trace."):
    import_module(module.name)
check_bag(bag)
trace = mauve_rt.trace.open(bag)
write_report(page, trace)
export_csv(trace, tables)
print(mauve_rt.__version__, *all_statistics(trace))
"""


def test_a_bag_is_read_and_shown(tmp_path: Path):
    page, tables = tmp_path / "report.html", tmp_path / "tables"
    command = [sys.executable, "-c", PROGRAM, record_small_bag(tmp_path / "bag"), page, tables]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{mauve_rt.__version__} a\n"
    assert "</html>" in page.read_text(encoding="utf-8")
    assert list(tables.glob("*.csv"))


COMMAND = """
import sys

for name in ("mauve_rt._kernel", "mauve_rt._bridge", "mauve_msgs", "rclpy", "std_msgs", "builtin_interfaces"):
    sys.modules[name] = None  # an import of it fails

from mauve_rt.cli.main import main

sys.exit(main())
"""


def _mauve(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", COMMAND, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_command_reads_bags_without_it(tmp_path: Path):
    bag = record_small_bag(tmp_path / "bag")
    for words in (("--help",), ("trace", "stats", bag), ("trace", "check", bag)):
        done = _mauve(*words)
        assert (done.returncode, done.stderr) == (0, ""), words
    done = _mauve("report", bag, "--out", tmp_path / "report.html")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "report.html").is_file()
