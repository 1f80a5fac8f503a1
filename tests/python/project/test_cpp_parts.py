"""What a C++ compiler tells the author of a part."""

import subprocess
from pathlib import Path

import pytest

HEADERS = Path(__file__).parents[3] / "mauve_rt/kernel/include"
PART = """
#include <mauve_rt/parts/core.hpp>
class Mine : public mauve::Core<mauve::Shell> {{
  {} override;
}};
"""


@pytest.mark.parametrize(
    ("hook", "refusal"),
    [
        ("bool configure_hook()", ""),
        ("void cleanup_hook()", ""),
        ("void configure()", "overriding final function"),
        ("void cleanup()", "overriding final function"),
    ],
)
def test_a_part_overrides_the_hooks_and_nothing_else(hook: str, refusal: str, tmp_path: Path) -> None:
    source = tmp_path / "part.cpp"
    source.write_text(PART.format(hook), encoding="utf-8")
    command = ["g++", "-std=c++20", "-fsyntax-only", f"-I{HEADERS}", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == (1 if refusal else 0), done.stderr
    assert refusal in done.stderr
