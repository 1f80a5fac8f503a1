"""The sample in docs/sample: a bag that reads as README says, and the report that is made from it."""

import html
import re
from pathlib import Path

import mauve_rt.trace
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.report import judge
from mauve_rt.trace.report.analysis import analyse

SAMPLE = Path(__file__).parents[3] / "docs/sample"


def test_the_bag_has_what_readme_says() -> None:
    trace = mauve_rt.trace.open(SAMPLE / "metronome")
    assert trace.lost == 0
    swaps = reconfigurations(trace)
    assert [(one.committed, one.missed_releases) for one in swaps] == [(True, 0), (True, 0)]
    assert analyse(trace).period_ns("metronome") == 5_000_000


def test_the_report_is_of_the_bag() -> None:
    page = html.unescape(re.sub("<[^>]*>", "", (SAMPLE / "report.html").read_text(encoding="utf-8")))
    verdict = judge(analyse(mauve_rt.trace.open(SAMPLE / "metronome")))
    assert verdict.sentence in page
    for sentence in verdict.sentences[:3]:
        assert sentence.text in page
