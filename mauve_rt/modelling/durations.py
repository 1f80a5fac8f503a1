"""Lengths of time as a model writes them: `10 ms`, `5 * unit_ms`, `forever`."""

import re
from dataclasses import dataclass
from decimal import Decimal

NS_OF = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000}
"""Units of time, in ns."""
MOST_NS = 2**63 - 1  # FOREVER of the kernel
EXPECTED = "a time such as 10 ms, or 5 * unit_ms of an integer property whose unit is ns, us, ms or s"
_MOST_DIGITS = 18  # of a factor: no product of more fits into 64 bits
_TIME = re.compile(r"(?=[\d.]*[1-9])(?P<number>\d+(?:\.\d+)?)\s*(?P<unit>ns|us|ms|s)", re.ASCII)
_MULTIPLE = re.compile(
    rf"(?:(?P<factor>[1-9]\d{{0,{_MOST_DIGITS - 1}}})\s*\*\s*)?(?P<property>[A-Za-z]\w*)", re.ASCII
)
PATTERN = f"{_TIME.pattern}|{_MULTIPLE.pattern}"
"""Texts that may be one."""


@dataclass(frozen=True)
class Duration:
    """A length of time: `ns`, or `factor` times an integer property of the shell."""

    ns: int = 0
    factor: int = 1
    property_name: str = ""

    @property
    def is_forever(self) -> bool:
        """Whether only an event or a stop ends it."""
        return self.ns == MOST_NS


def parse_duration(text: str) -> Duration | None:
    """A length of time > 0; None where the text is none, or no whole number of ns."""
    if text == "forever":
        return Duration(ns=MOST_NS)
    if found := _TIME.fullmatch(text):
        ns = Decimal(found["number"]) * NS_OF[found["unit"]]
        return Duration(ns=int(ns)) if ns == int(ns) and ns < MOST_NS else None
    if found := _MULTIPLE.fullmatch(text):
        return Duration(factor=int(found["factor"] or 1), property_name=found["property"])
    return None


def duration_text(ns: int) -> str:
    """As a model writes it, in the largest unit that keeps it whole."""
    if ns == MOST_NS:
        return "forever"
    unit = next(unit for unit in ("s", "ms", "us", "ns") if ns % NS_OF[unit] == 0)
    return f"{ns // NS_OF[unit]} {unit}"
