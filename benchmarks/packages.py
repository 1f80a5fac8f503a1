"""Programs of other packages that benchmarks compare with or load the machine with."""

import os
import shutil
import subprocess
import sys


def available(program: str, package: str) -> str:
    """Empty when the program can be run, else why not; installs it where that is allowed."""
    if shutil.which(program):
        return ""
    remedy = f"{program} is not installed: apt-get install {package}"
    if os.geteuid() != 0 or not shutil.which("apt-get"):
        return remedy
    sys.stderr.write(f"bench: installing {package} for {program}\n")
    return "" if _apt("install", package) or (_apt("update") and _apt("install", package)) else remedy


def _apt(*words: str) -> bool:
    return subprocess.run(["apt-get", "-y", "-qq", *words], capture_output=True, check=False).returncode == 0
