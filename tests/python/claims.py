"""The claims of the pages: sentences with a promise or a figure, and the marks that name their proofs.

A mark stands directly behind its sentence, in a table at the end of the row: `<!-- claim: PROOF, PROOF -->`
(proofs.py says which proofs there are), `<!-- measured: 2026-11-26, HOW -->` for figures that no test can
hold, or `<!-- no claim -->`.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from check_claims import MARK, is_test, proofs_of
from page_blocks import blocks
from proofs import sources

PAGES_OF_CLAIMS = (
    "README.md",
    *(
        f"docs/concepts/{name}.md"
        for name in (
            *("basic_elements", "components", "deployment", "failures_of_peers", "faults", "kernel_rules"),
            *("performance", "replacing", "resources", "rules_overview", "source_tree", "traces"),
        )
    ),
    *(
        f"docs/howto/{name}.md"
        for name in (
            *(
                "compare_in_shadow",
                "install",
                "limit_outputs",
                "log_lines",
                "operate",
                "record_and_report",
                "reload_code",
                "see_values",
            ),
            *("see_values", "try_on_probation", "write_a_core"),
        )
    ),
)
"""Each promise and each figure of these has a mark. On other pages only what has a mark is checked."""

# A relative clause ("a state that does not end") promises nothing.
PROMISE = re.compile(
    r"\b(?:(?i:never|always|at most|at least|at once|not at all|none|nothing|nobody|neither|only|every|cannot"
    r"|refuse[sd]?|no(?= \w)|without a|(?<!that )(?<!which )(?<!who )(?:do|does|is|are) not)|Each|All)\b"
)
# test_bench_docs.py holds it.
GENERATED = re.compile(r"<!-- figures: .*?<!-- end of the figures[^>]*-->", re.DOTALL)
NO_PROSE = re.compile(r"#|!\[|<!-- (?!claim|measured|no claim)")
ITEM = re.compile(r"\s*(?:- |\d+\. |\|)")
END_OF_SENTENCE = re.compile(r"(?<=[.!?:])\s+(?=[A-Z`*\[(~])|(?<=-->)\s+(?!<)")

SCALES = {
    "s": {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "minute": 60.0, "minutes": 60.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "times a second": 1.0},
    "B": {"bytes": 1.0, "KiB": 2.0**10, "MiB": 2.0**20, "MB": 1e6, "GB": 1e9},
    "%": {"%": 1.0},
    "m": {"mm": 1e-3, "m": 1.0},
}
UNITS = {unit: (kind, scale) for kind, scales in SCALES.items() for unit, scale in scales.items()}
WORDS = {"every": "1", "two": "2", "three": "3", "four": "4", "five": "5", "six": "6", "ten": "10"}
# Names of products, versions, sections and days have numbers that are no figures.
NAMED = re.compile(
    r"\d{4}-\d\d-\d\d"
    r"|\b(?:ROS|Debian|Ubuntu|YAML|Fig\.|Listings?|clang from|Nav2 before)(?:,?(?: and| to)? \d+(?:\.\d+)*)+"
)
_NUMBER = r"(\d+(?:[,_']\d{3})*(?:\.\d+)?(?:e[+-]?\d+)?)"
_UNIT = "|".join(sorted(UNITS, key=len, reverse=True))
FIGURE = re.compile(
    rf"(?<![\w#./=:-]){_NUMBER}(?!\w|\.\d)(?: ?({_UNIT})(?!\w))?"
    r"|\b(?i:(every|two|three|four|five|six|ten)) (times a second|minutes?)"
)
CODE = re.compile(r"`[^`]*`")
NO_END = re.compile(rf"{CODE.pattern}|{MARK.pattern}")
FIGURE_OF_CODE = re.compile(rf"(?<!\w){_NUMBER} ({_UNIT})(?!\w)")
# Of sources: NAME_S = 5.0, kAfterNs{500'000'000}, ms_to_ns(1), 500ms, "500 ms".
LITERAL = re.compile(rf"(?:(\w+)[\"']?(?:: ?\w+)?[\s=({{:]+)?(?<![\w.]){_NUMBER}(?: ?({_UNIT})(?!\w))?")
UNIT_OF_NAME = re.compile(r"^(ns|us|ms|s)_to_|_((?i:ns|us|ms|s|hz|bytes))$|(?<=[a-z])(Ns|Us|Ms|S|Hz|Bytes)$")


@dataclass(frozen=True)
class Sentence:
    """A sentence or a row of a table, with the marks behind it."""

    line: int
    text: str
    marks: tuple[re.Match[str], ...]

    @property
    def is_promise(self) -> bool:
        """Whether it has a word of a promise outside of code."""
        return bool(PROMISE.search(CODE.sub("`", self.text)))

    @property
    def figures(self) -> list[tuple[str, float, str]]:
        """Each number that is no name's: as it is written, its value, its unit or nothing."""
        text = NAMED.sub("", self.text)
        in_code = [found.groups() for code in CODE.findall(text) for found in FIGURE_OF_CODE.finditer(code)]
        found = [
            (found[1] or WORDS[found[3].lower()], found[2] or found[4] or "")
            for found in FIGURE.finditer(CODE.sub("`", text))
        ]
        return [(f"{number} {unit}".strip(), _value(number), unit) for number, unit in in_code + found]


def sentences(page: str) -> Iterator[Sentence]:
    """Yield the sentences of a page; no code, no heading, nothing generated."""
    page = GENERATED.sub(lambda found: "\n" * found[0].count("\n"), page)
    code = {line for block in blocks(page) for line in block.lines}
    lines = ["" if n in code or NO_PROSE.match(text) else text for n, text in enumerate(page.splitlines())]
    begin = 0
    for number, line in enumerate([*lines, ""]):
        ends = not line.strip() or ITEM.match(line)
        if number > begin and ends:
            yield from _sentences_of("\n".join(lines[begin:number]), begin + 1)
        if ends:
            begin = number


def _sentences_of(paragraph: str, first_line: int) -> Iterator[Sentence]:
    begin = 0
    paragraph = re.sub(r"^ *(?:-|\d+\.) ", lambda found: " " * len(found[0]), paragraph)
    joined = NO_END.sub(lambda found: found[0][0] + re.sub(r"[^->]", "x", found[0][1:]), paragraph)
    ends = [] if paragraph.startswith("|") else END_OF_SENTENCE.finditer(joined)
    for end in (*ends, None):
        text = paragraph[begin : end.start() if end else len(paragraph)]
        plain = " ".join(re.sub(r"\]\([^)]*\)", "]", MARK.sub("", text)).split())
        line = first_line + paragraph.count("\n", 0, begin + len(text) - len(text.lstrip()))
        if plain:
            yield Sentence(line, plain, tuple(MARK.finditer(text)))
        begin = end.end() if end else begin


def _value(number: str) -> float:
    return float(re.sub(r"[,_']", "", number))


def is_pinned(value: float, unit: str, source: str) -> bool:
    """Whether a source has this quantity, in whichever unit; without a unit, whether it has this number."""
    kind, scale = UNITS.get(unit, ("", 1.0))
    for found in LITERAL.finditer(source):
        name, number = UNIT_OF_NAME.search(found[1] or ""), _value(found[2])
        of_name = next(filter(None, name.groups())).lower() if name else ""
        given = found[3] or {"hz": "Hz"}.get(of_name, of_name)
        units = [UNITS[given]] if given else list(UNITS.values())
        same = [number * each for of, each in units if of == kind] if kind else [number]
        if kind == "Hz" and number:  # a period
            same += [1 / (number * each) for of, each in units if of == "s"]
        if kind == "%" and not given:
            same.append(number * 100)
        if any(math.isclose(value * scale, each, rel_tol=1e-9) for each in same):
            return True
    return False


def _wrong_proofs(proofs: list[str]) -> Iterator[str]:
    for proof in proofs:
        if (count := len(sources(proof))) != 1:
            remedy = "Name a test that is there." if count == 0 else "Write folder/test_file.py::test_name."
            yield f"the mark names {proof!r}: expected 1 test, found {count}. {remedy}"
    if proofs and not any(map(is_test, proofs)):
        yield "no proof of the mark runs with the tests. Name a test, too."


def _wrong_figures(sentence: Sentence, proofs: list[str]) -> Iterator[str]:
    """The figures that no proof has. Where the mark names constants, these alone hold the figures."""
    constants = [proof for proof in proofs if not is_test(proof) and "::" in proof]
    held = "\n".join(source for proof in constants or proofs for source in sources(proof))
    for words, value, unit in sentence.figures:
        if not is_pinned(value, unit, held):
            yield f"no proof has the figure {words!r}. Correct it, or name its constant: file::NAME."


def _wrong_kinds(sentence: Sentence) -> Iterator[str]:
    kinds = {mark[1]: mark[2] or "" for mark in sentence.marks}
    if "no claim" in kinds and not (sentence.is_promise or sentence.figures):
        yield "no claim is taken for one. Remove the mark."
    if "measured" in kinds and not (sentence.figures and re.match(r"\d{4}-\d\d-\d\d, \S", kinds["measured"])):
        yield "expected a figure and the day. Write <!-- measured: 2026-11-26, HOW -->."


def _missing_mark(sentence: Sentence) -> Iterator[str]:
    kinds = {mark[1] for mark in sentence.marks}
    if sentence.figures and not kinds:
        yield f"the figure {sentence.figures[0][0]!r} has no mark. Name its test: <!-- claim: test_name -->."
    elif sentence.is_promise and not kinds & {"claim", "no claim"}:
        yield "a promise without a mark. Name its test: <!-- claim: test_name -->."


def _problems_of(sentence: Sentence) -> Iterator[str]:
    proofs = [proof for mark in sentence.marks for proof in proofs_of(mark)]
    yield from _wrong_proofs(proofs)
    if proofs and not any(mark[1] == "measured" for mark in sentence.marks):
        yield from _wrong_figures(sentence, proofs)
    yield from _wrong_kinds(sentence)


def problems(name: str, page: str) -> list[str]:
    """Return what is wrong with the claims of a page: where, what, and the remedy."""
    found, read = [], 0
    for sentence in sentences(page):
        wrong = [*_problems_of(sentence), *(_missing_mark(sentence) if name in PAGES_OF_CLAIMS else ())]
        found += [f"{name}:{sentence.line}: {sentence.text!r}: {problem}" for problem in wrong]
        read += len(sentence.marks)
    if read != len(re.findall("<!-- ?(?:claim|measured|no claim)", page)):
        found.append(f"{name}: a mark is malformed or stands in code. Write <!-- claim: NAME, NAME -->.")
    return found + [
        f"{name}:{number}: a mark at the beginning of a line ends its paragraph. Put it behind the sentence."
        for number, line in enumerate(page.splitlines(), 1)
        if MARK.match(line.lstrip("->| "))
    ]
