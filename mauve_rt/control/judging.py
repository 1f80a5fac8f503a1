"""Whether the executor makes a change, by its timing. Loads the analysis at the first verdict."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mauve_rt.control.requests import Code, RefusalError, Request, TimingVerdict
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import ArchitectureFileError, MauveError, one_line
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.model.threads import ThreadInfo

if TYPE_CHECKING:
    from mauve_rt.analysis.study import Study
    from mauve_rt.control.timing import Timing

_WITNESS = "for the run: mauve analyze NODE --plan STEPS --witness DIR"
_SHOWN_MISSING = 5


_WHEN = ("now", "during the change", "after it")


@dataclass(frozen=True)
class Judged:
    """The verdicts before, during and after a change; none: it is not judged."""

    verdicts: tuple[TimingVerdict, ...] = ()
    objection: str = ""
    """What speaks against the change; empty: it is schedulable, or asks for no more than there is."""
    is_refused: bool = False
    is_idle: bool = False
    """Whether it has to be made at an idle instant."""

    def require(self) -> None:
        """Before the change.

        Raises:
            RefusalError: NOT_SCHEDULABLE.
        """
        if self.is_refused:
            raise RefusalError(Code.NOT_SCHEDULABLE, self.objection, self.verdicts)

    def words(self) -> Iterator[str]:
        """The verdicts, for a message."""
        names = _WHEN if len(self.verdicts) == len(_WHEN) else ("timing",)
        for name, verdict in zip(names, self.verdicts, strict=False):
            yield f"{name}: {verdict.sentence}"


class Judge:
    """Judges changes of one executor. From any thread: what it keeps is exchanged whole."""

    def __init__(
        self,
        runtime: Runtime,
        *,
        uses: Callable[[], Mapping[str, Collection[str]]] = dict,
        others: Callable[[], Iterable[ThreadInfo]] = tuple,
    ) -> None:
        """`uses` and `others`: as for `threads_of`."""
        self._runtime = runtime
        self._uses, self._others = uses, others
        self._timing: Timing | None = None

    @property
    def timing(self) -> "Timing":
        """What is known of what runs; it loads the analysis."""
        from mauve_rt.control.timing import Timing  # noqa: PLC0415 - only where it is asked for

        if self._timing is None:
            self._timing = Timing(self._runtime, uses=self._uses, others=self._others)
        return self._timing

    @property
    def requirement(self) -> bool | str:
        """What the file says: True, `warn`, or False."""
        return self._runtime.model.executor.require_schedulable

    def of_request(self, request: Request, steps: Sequence[Step]) -> Judged:
        """What is known of a change that a request makes, or would make.

        Nothing of a rule's: its action is judged when the rule is loaded. Nothing of what protects.
        """
        goes_back = request.reload is not None and request.reload.back
        if request.rule or goes_back or not (self.requirement or request.dry_run):
            return Judged()
        if protects(steps) and not request.dry_run:
            return Judged()
        judged = self.of_steps(
            steps, always=request.dry_run, is_idle=request.idle, awaits_idle=self.requirement is True
        )
        if protects(steps):
            return Judged(judged.verdicts)
        return replace(judged, is_refused=bool(judged.objection) and self.requirement is True)

    def of_steps(
        self,
        steps: Sequence[Step],
        *,
        always: bool = True,
        is_idle: bool = False,
        awaits_idle: bool = False,
    ) -> Judged:
        """The verdicts on steps that the executor accepts; unless `always`, none where no demand grows.

        `is_idle` and `awaits_idle`: as for `judged_change`.
        """
        from mauve_rt.analysis.errors import AnalysisError  # noqa: PLC0415 - only where it is asked for
        from mauve_rt.analysis.time_limit import NoVerdictError  # noqa: PLC0415
        from mauve_rt.control.timing import VERDICT_NS  # noqa: PLC0415

        try:
            found = self.timing.of_change(steps, always=always, is_idle=is_idle, awaits_idle=awaits_idle)
        except NoVerdictError:
            return _not_proved(f"no verdict within {VERDICT_NS / 1e6:.0f} ms of CPU time")
        except (AnalysisError, MauveError) as error:
            return _not_proved(one_line(str(error)))
        if found is None:
            return Judged()
        studies = (found.now, found.judged.during, found.judged.after)
        objections = [] if found.lowers_demand else [*_objections(studies)]
        verdicts = tuple(map(_verdict, studies))
        return Judged(verdicts, next(iter(objections), ""), is_idle=found.judged.is_idle)


class NotSchedulableError(ArchitectureFileError):
    """Actions of rules that an executor which requires schedulable changes does not load."""


def protects(steps: Iterable[Step]) -> bool:
    """Whether steps only stop, remove or go back: such a change is never refused for its timing."""
    return all(STEP_KINDS[step.kind].protects for step in steps)


def _not_proved(why: str) -> Judged:
    from mauve_rt.analysis.verdict import Outcome, Verdict  # noqa: PLC0415

    words = Verdict(Outcome.NOT_PROVED, why).sentence
    return Judged((TimingVerdict(outcome=str(Outcome.NOT_PROVED), sentence=words),), words)


def _objections(studies: "Sequence[Study]") -> "Iterator[str]":
    from mauve_rt.analysis.verdict import Outcome  # noqa: PLC0415

    for when, study in zip(_WHEN[1:], studies[1:], strict=True):
        if study.verdict.outcome is Outcome.SCHEDULABLE:
            continue
        shown = study.missing[:_SHOWN_MISSING]
        left = len(study.missing) - len(shown)
        more = [f"and {left} more"] if left else []
        witness = [_WITNESS] if study.verdict.witness is not None else []
        yield "; ".join([f"{when}: {study.verdict.sentence}", *shown, *more, *witness])


def _verdict(study: "Study") -> TimingVerdict:
    from mauve_rt.analysis.witness_json import witness_json  # noqa: PLC0415

    return TimingVerdict(
        outcome=str(study.verdict.outcome),
        sentence=study.verdict.sentence,
        missing=tuple(study.missing),
        witness=witness_json(study),
    )
