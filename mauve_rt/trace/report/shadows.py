"""Shadows in a report: candidates with their verdicts, and how their outputs differed."""

import math

from mauve_rt.trace.reading.shadows import OutputStep, Shadow, ShadowOutput
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Cell, Section, table
from mauve_rt.trace.report.output_curves import output_curves
from mauve_rt.trace.report.units import number_text, time_text

_MANY_ROWS = 400
_SHADOWS = ("begin", "component", "candidate", "live core", "verdict", "reason", "releases", "compared")
_OUTPUTS = ("component", "candidate", "output", "compared", "largest difference", "rms", "NaN", "lag")

_STEPS = ("component", "candidate", "verdict", "output", "greatest", "difference", "least difference", "step")


def shadows_section(analysis: Analysis) -> Section | None:
    """Return the tables of shadows and of their outputs; None when there was no shadow."""
    found = analysis.trace.shadows[:_MANY_ROWS]
    if not found:
        return None
    columns = (*_SHADOWS, "skipped: late", "skipped: budget", "idle", "over budget", "largest execution")
    html = table((*columns, "budget"), [_row(one, analysis.zero_ns) for one in found])
    html += "<h3>Differences of the outputs</h3>"
    html += table(_OUTPUTS, [_output_row(one, output) for one in found for output in one.outputs])
    steps = [_step_row(one, step) for one in found for step in one.steps]
    if steps:
        html += f"<h3>Outputs of bumpless changes</h3>{table(_STEPS, steps)}{output_curves(found)}"
    more = len(analysis.trace.shadows) - len(found)
    return Section(
        "Shadows",
        html + (f"<p>{more:,} more are not listed.</p>" if more > 0 else ""),
        note="Candidate cores that executed in parallel with the live core, on the same inputs. "
        "Skipped: late, as the shadow's thread was late; budget, to stay within the budget. "
        "Lag: releases by which the candidate's first number of the port is later. "
        "Step: the new core's first output minus the old core's last one. "
        "T: the component runs with the new core from then on; without a swap, 0 ms is the last release "
        "that was compared. "
        "Verdict running: the shadow ran when the recording ended.",
        anchor="shadows",
    )


def _row(one: Shadow, zero_ns: int) -> tuple[object, ...]:
    return (
        Cell(time_text(one.begin_ns - zero_ns), tip=f"{one.begin_ns - zero_ns:,} ns"),
        *(one.component, one.core, one.live_core),
        Cell(one.verdict, "bad" if one.verdict == "faulted" else "", number=False),
        one.reason,
        *(one.releases, one.compared, one.skipped_late, one.skipped_budget, one.idle, one.over_budget),
        Cell(time_text(one.largest_execution_ns)),
        Cell(time_text(one.budget_ns)),
    )


def _step_row(one: Shadow, step: OutputStep) -> tuple[object, ...]:
    return (
        *(one.component, one.core, one.verdict, step.output),
        *(Cell(_known(number)) for number in (step.greatest, step.difference, step.least, step.step)),
    )


def _known(number: float) -> str:
    return "" if math.isnan(number) else number_text(number)


def _output_row(one: Shadow, output: ShadowOutput) -> tuple[object, ...]:
    return (
        *(one.component, one.core, output.name, output.compared),
        Cell(number_text(output.maximum)),
        Cell(number_text(output.rms)),
        Cell(f"{output.nan:,}", "bad" if output.nan else ""),
        output.lag,
    )
