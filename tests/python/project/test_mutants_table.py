"""The table of planted faults fits the sources: each original text is there once."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
MUTANTS = ROOT / "tests" / "seeds" / "mutants"


def test_the_table_of_mutants_fits_the_sources(tmp_path: Path) -> None:
    words = [MUTANTS / "plant.py", "--source", ROOT, "--to", tmp_path, "--table", MUTANTS / "mutants.yaml"]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
