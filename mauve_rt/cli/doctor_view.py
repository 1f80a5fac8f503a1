"""What `mauve doctor` prints: a line for each finding, cost and remedy beneath, a histogram for each CPU."""

from collections.abc import Sequence

from rich.markup import escape

from mauve_rt.cli.views import console
from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Finding, Status
from mauve_rt.doctor.wakeup import CpuWakeup, Wakeup

_STYLES = {Status.OK: "green", Status.WARNING: "yellow", Status.ERROR: "bold red"}
_WORDS = {Status.OK: "OK", Status.WARNING: "warning", Status.ERROR: "error"}
_STATUS_WIDTH, _NAME_WIDTH, _BAR_WIDTH = 8, 20, 40
_LONGEST = 400  # of a line; --json has all of it


def print_finding(finding: Finding) -> None:
    """Print one line, and beneath it what it costs and the remedy."""
    out = console()
    word = _WORDS[finding.status].ljust(_STATUS_WIDTH)
    line = f"{escape(finding.name.ljust(_NAME_WIDTH))} {escape(finding.found)}"
    out.print(f"[{_STYLES[finding.status]}]{word}[/]{line}", soft_wrap=True)
    for what, text in (("cost", finding.cost), ("remedy", finding.remedy)):
        if text:
            shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}... (whole in --json)"
            out.print(f"{' ' * _STATUS_WIDTH}[dim]{what}:[/] {escape(shown)}", soft_wrap=True)


def print_wakeup(wakeup: Wakeup) -> None:
    """Print the latencies on each CPU: quantiles, and a bar for each range that has any."""
    out = console()
    for cpu in wakeup.cpus:
        figures = " ".join(
            f"{what} {value:.1f}"
            for what, value in (
                ("min", cpu.min_us),
                ("median", cpu.median_us),
                ("99.9%", cpu.p999_us),
                ("max", cpu.max_us),
            )
        )
        out.print(
            f"\n[bold]CPU {cpu.cpu}[/] {cpu.policy}: {figures} us, {cpu.count:,} wake-ups", soft_wrap=True
        )
        for line in _bars(cpu):
            out.print(line, soft_wrap=True)
    if wakeup.overhead_ns is not None:
        cost = f"{wakeup.overhead_ns / 1e3:.1f} us of CPU time on average"
        out.print(f"\nA release takes {cost}, with its wake-up and its wait.", soft_wrap=True)


def print_summary(findings: Sequence[Finding]) -> None:
    """Print how many errors and warnings there are."""
    count = {status: sum(each.status == status for each in findings) for status in Status}
    text = f"{counted(count[Status.ERROR], 'error')}, {counted(count[Status.WARNING], 'warning')}"
    console().print(f"\n{text}", style="bold")


def _bars(cpu: CpuWakeup) -> list[str]:
    """One line for each range from the first to the last that has a latency."""
    most = max(count for _, count in cpu.histogram)
    rows = []
    below = 0.0
    for edge, count in cpu.histogram:
        text = f"{below:g} to {edge:g} us" if edge is not None else f"{below:g} us or more"
        bar = "#" * max(round(_BAR_WIDTH * count / most), 1 if count else 0)
        rows.append((count, f"  {text:>18} {count:>8,} {bar}"))
        below = edge if edge is not None else below
    filled = [place for place, (count, _) in enumerate(rows) if count]
    return [line for _, line in rows[filled[0] : filled[-1] + 1]]
