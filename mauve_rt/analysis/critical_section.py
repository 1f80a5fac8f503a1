"""For how long a job holds a resource."""

from dataclasses import dataclass

from mauve_rt.analysis.errors import AnalysisError


@dataclass(frozen=True, kw_only=True)
class CriticalSection:
    """The longest time for which a job holds one resource.

    A job must not wait for a ROS service while it holds a resource: no bound on blocking covers such a wait.

    Attributes:
        resource: name of the resource, whose mutex inherits priorities.
        length_ns: longest execution from lock to unlock, nested sections included.
        inside: name of the resource that the job already holds when it locks this one; empty if there is
        none.

    Raises:
        AnalysisError: the length is not a positive whole number, or the section is inside itself.

    """

    resource: str
    length_ns: int
    inside: str = ""

    def __post_init__(self) -> None:
        where = f"section of {self.resource}"
        if type(self.length_ns) is not int or self.length_ns < 1:
            raise AnalysisError(
                where,
                "length_ns",
                expected="a whole number >= 1",
                found=repr(self.length_ns),
                remedy="Give the length in whole nanoseconds",
            )
        if self.inside == self.resource:
            raise AnalysisError(
                where,
                "inside",
                expected="another resource",
                found=self.inside,
                remedy="Lock a resource once",
            )
