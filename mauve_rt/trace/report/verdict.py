"""Did it hold its timing? Yes, no, or not proved: in one sentence, with the reasons by their weight."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import details, prose
from mauve_rt.trace.report.machine import Machine, machine_of
from mauve_rt.trace.report.sentences import ATTENTION, BAD, GOOD, Sentence, sentences_on
from mauve_rt.trace.report.units import counted, listed

QUESTION = "Did the timing hold?"
YES, NO, NOT_PROVED = "Yes", "No", "Not proved"
_ORDER = ("", GOOD, ATTENTION, BAD)
_READ_AT_ONCE = 5
"""Sentences that are not folded."""


@dataclass(frozen=True)
class Verdict:
    """What stands at the top of a report."""

    level: str
    """good, attention, bad"""
    headline: str
    """One sentence, without the answer."""
    sentences: Sequence[Sentence]
    """The reasons, the most important first."""
    answer: str = ""
    """Yes, No or Not proved; empty when the headline answers no question."""
    lead: str = QUESTION
    """Above the headline: the question that is answered, or the outcome in a word."""

    also: Sentence | None = None
    """A second outcome, below the headline."""

    @property
    def sentence(self) -> str:
        """Answer and headline."""
        return f"{self.answer}: {self.headline}" if self.answer else self.headline


def judge(analysis: Analysis) -> Verdict:
    """Return the verdict on a trace."""
    machine = machine_of(analysis)
    sentences = sentences_on(analysis, machine)
    level = max((GOOD, *(one.level for one in sentences)), key=_ORDER.index)
    answer, headline = _answer(analysis, machine)
    return Verdict(level, headline, sentences, answer)


def verdict_html(verdict: Verdict, *, title: str) -> str:
    """Return the top of the page."""
    also = verdict.also
    second = f'<p class="also {also.level}">{prose(also.text)}</p>' if also else ""
    answer = f"<strong>{prose(verdict.answer)}</strong>: " if verdict.answer else ""
    at_once, rest = verdict.sentences[:_READ_AT_ONCE], verdict.sentences[_READ_AT_ONCE:]
    folded = details(f"{len(rest)} more facts", _list(rest)) if len(rest) > 1 else ""
    return (
        f'<div class="verdict {verdict.level}"><p class="title">{prose(title)}</p>'
        f'<p class="lead"><i aria-hidden="true"></i>{prose(verdict.lead)}</p>'
        f"<h1>{answer}{prose(verdict.headline)}</h1>{second}"
        f"{_list(at_once if folded else verdict.sentences)}{folded}</div>"
    )


def _list(sentences: Sequence[Sentence]) -> str:
    items = "".join(f'<li class="{one.level}">{prose(one.text)}</li>' for one in sentences)
    return f'<ul class="sentences">{items}</ul>'


def _answer(analysis: Analysis, machine: Machine) -> tuple[str, str]:
    if not any(one.releases for one in analysis.statistics.values()):
        return NOT_PROVED, "the trace holds no release."
    wrong = list(_wrong(analysis, machine))
    if wrong:
        return NO, f"{listed(wrong)}."
    if analysis.trace.lost:
        return NOT_PROVED, "nothing was late in what was recorded, but records are missing."
    if not analysis.swaps:
        return YES, "no overrun, no fault."
    swaps = counted(len(analysis.swaps), "reconfiguration")
    known = all(swap.measured.missed_releases is not None for swap in analysis.swaps)
    return YES, f"no overrun, no fault, and {swaps}{' without a missed release' if known else ''}."


def _wrong(analysis: Analysis, machine: Machine) -> Iterator[str]:
    """Whatever makes the answer No."""
    found = analysis.statistics.values()
    overruns = sum(one.overruns for one in found)
    missed = sum(swap.measured.missed_releases or 0 for swap in analysis.swaps)
    if analysis.faults:
        yield counted(len(analysis.faults), "fault")
    if analysis.misses:
        yield counted(len(analysis.misses), "missed deadline")
    if overruns:
        releases = counted(sum(one.releases for one in found), "release")
        least = "at least " if analysis.trace.lost else ""
        yield f"{least}{counted(overruns, 'overrun')} in {releases}{_excuse(machine, overruns)}"
    if missed:
        yield counted(missed, "release") + " missed in reconfigurations"
    if any(swap.measured.phase_nominal_ns for swap in analysis.swaps):
        yield "a phase that was not kept"


def _excuse(machine: Machine, overruns: int) -> str:
    stalled = sum(machine.overruns.values())
    if not stalled:
        return ""
    which = "" if overruns == 1 else "all " if stalled == overruns else f"{stalled:,} of them "
    return f" ({which}while the machine stalled)"
