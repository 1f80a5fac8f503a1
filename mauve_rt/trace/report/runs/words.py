"""The comparison of two runs in words: the verdict, a sentence for each difference, numbers as text."""

import math
from collections.abc import Iterator

from mauve_rt.trace.report.runs.compared import ComparedRuns, only_in_one
from mauve_rt.trace.report.runs.noise import Judged
from mauve_rt.trace.report.runs.timing import Figure
from mauve_rt.trace.report.sentences import ATTENTION, GOOD, Sentence
from mauve_rt.trace.report.units import counted, number_text, time_text
from mauve_rt.trace.report.verdict import Verdict

LEAD = "Do the two runs differ?"
METHOD = (
    "A mark means that the difference is larger than the noise: the whole interval excludes no change, and "
    "the change exceeds the change between the odd and the even blocks of either run. The intervals hold at "
    "95 % for all {tested} figures together (Bonferroni)."
)
LIMIT = (
    "The noise is measured within each run. Another load of the computer during one of the runs is marked as "
    "a difference, too."
)
SHORT = (
    "The noise of a run needs at least 20 blocks: of 25 releases each, or of 0.5 s with 5 releases each. "
    "Record longer runs."
)
_NAMED = 24
_NONE = "\N{EN DASH}"
_MINUS = "\N{MINUS SIGN}"
_TIMES = "\N{MULTIPLICATION SIGN}"
_NEAR_ONE, _LARGE = 0.1, 100


def verdict_on(found: ComparedRuns) -> Verdict:
    """Return the verdict: how many figures differ, the sentences on these, and what only one run has."""
    differing = sorted(found.differing, key=_weight, reverse=True)
    sentences = [Sentence(ATTENTION, figure_in_words(figure)) for figure in differing[1:_NAMED]]
    if len(differing) > _NAMED:
        sentences.append(
            Sentence(ATTENTION, f"The tables mark {counted(len(differing) - _NAMED, 'more figure')}.")
        )
    sentences += [Sentence(ATTENTION, f"Only in {run}: {thing}.") for run, thing in only_in_one(found)]
    sentences += list(_instants(found))
    lossy = [name for name, trace in zip("AB", found.traces, strict=True) if trace.lost]
    sentences += [Sentence(ATTENTION, f"Records of {run} are missing.") for run in lossy]
    method = [METHOD.format(tested=found.tested), LIMIT] if found.tested else [SHORT]
    sentences += [Sentence("", text) for text in method]
    level = ATTENTION if any(one.level for one in sentences) or differing else GOOD
    return Verdict(level, _headline(found, differing), sentences, lead=LEAD)


def _headline(found: ComparedRuns, differing: list[Figure]) -> str:
    if differing:
        figures = counted(len(differing), "figure")
        return f"B differs from A in {figures} by more than chance: {figure_in_words(differing[0])}"
    if any(field.differs for field in found.values.fields):
        return "No timing differs by more than chance, but values differ at equal instants."
    if found.tested == 0 and not found.simulated:
        return "No difference is proved: the runs are too short to tell."
    return "No figure differs by more than chance."


def _instants(found: ComparedRuns) -> Iterator[Sentence]:
    """Values that differ in simulated time, where no chance is."""
    for field in found.values.fields:
        if field.largest_difference:
            apart = number_text(field.largest_difference)
            text = f"{field.field.topic} {field.field.name} differs by up to {apart} at equal instants."
            yield Sentence(ATTENTION, text)


def _weight(figure: Figure) -> float:
    """How much a figure differs, to put the largest difference first."""
    judged = figure.judged
    if judged is None:
        return 0.0
    if judged.is_ratio:
        return abs(math.log(judged.value)) if 0 < judged.value < math.inf else math.inf
    return abs(judged.value) / (abs(figure.a) + abs(figure.b))


def figure_in_words(figure: Figure) -> str:
    """Return how a figure of B differs from that of A, as a sentence."""
    if figure.judged is None:
        return f"{figure.subject}: {figure.name} is {text_of(figure, figure.b)}."
    both = f"{text_of(figure, figure.a)} in A, {text_of(figure, figure.b)} in B"
    if figure.statistic == "count":
        if not (figure.a and figure.b):
            return f"{figure.subject}: {figure.measure}: {both}."
        rate = f"{figure.subject}'s {figure.measure} per release are"
    else:
        rate = f"{figure.subject}'s {figure.name} is"
    change, interval = change_text(figure), interval_text(figure)
    if figure.judged.is_ratio:
        return f"{rate} {change} {_TIMES} {interval} of A's ({both})."
    statistic = figure.statistic if figure.measure == "value" else figure.name
    return f"{figure.subject}: the {statistic} differs by {change} {interval} ({both})."


def change_text(figure: Figure) -> str:
    """Return B / A, or B - A with its sign and unit; a dash without an interval."""
    judged = figure.judged
    return _NONE if judged is None else _change(judged.value, figure, judged)


def interval_text(figure: Figure) -> str:
    """Return the interval as [low, high]; a dash without one."""
    judged = figure.judged
    if judged is None:
        return _NONE
    return f"[{_change(judged.low, figure, judged)}, {_change(judged.high, figure, judged)}]"


def text_of(figure: Figure, value: float) -> str:
    """Return a figure's value with its unit."""
    if figure.is_time:
        return time_text(value)
    return f"{int(value):,}" if figure.statistic == "count" else number_text(value)


def mark_text(figure: Figure) -> str:
    """Return `yes` or `no`: is the difference larger than the noise? Or why this cannot be told."""
    if figure.judged is None:
        return figure.remark or _NONE
    return "yes" if figure.judged.differs else "no"


def _change(value: float, figure: Figure, judged: Judged) -> str:
    if judged.is_ratio:
        return _ratio_text(value, digits=3 if abs(judged.value - 1) < _NEAR_ONE else 2)
    text = time_text(value) if figure.is_time else number_text(value)
    return f"+{text}" if value > 0 else text


def _ratio_text(ratio: float, *, digits: int) -> str:
    if math.isinf(ratio):
        return "\N{INFINITY}"
    if ratio >= _LARGE:
        return f"{ratio:,.0f}"
    return f"{ratio:.{digits if ratio >= _NEAR_ONE else 3}f}"
