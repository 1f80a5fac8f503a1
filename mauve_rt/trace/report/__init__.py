"""`mauve report`: one self-contained page about a trace, for a person to look at.

    write_report(Path("report.html"), mauve_rt.trace.open("bag"))

`analysis` computes everything once; `verdict` with its `sentences`, `key_figures`, `timeline`, `comparison`,
`distributions`, `architecture_section` and `tables` are the page's parts; `blocks`, `svg`, `histograms` what
they are made of.
`runs` compares two runs, on a page of its own.
The timeline is drawn by the scripts in `static`, from `columns` that hold what `detail` keeps.
"""

from mauve_rt.trace.report.blocks import Card, Section
from mauve_rt.trace.report.report import write_report
from mauve_rt.trace.report.sentences import Sentence
from mauve_rt.trace.report.verdict import Verdict, judge

__all__ = ["Card", "Section", "Sentence", "Verdict", "judge", "write_report"]
