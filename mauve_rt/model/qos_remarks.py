"""What a subscription asks of publishers that ordinary ones do not offer: no message would ever come.

DDS connects two only where the offer is no less than the request: a deadline or lease no longer than asked
for, messages kept for late joiners where they are asked for. A publisher that says nothing offers none of it.
What a publisher of ours offers goes to everybody, and needs no remark.
"""

from collections.abc import Iterator

from mauve_rt.errors import Problem
from mauve_rt.model.architecture_file import ArchitectureModel
from mauve_rt.model.schema import TopicModel


def qos_remarks(topic: TopicModel) -> Iterator[tuple[str, str, str]]:
    """(field, what it will not match, remedy) of each such request."""
    qos = topic.qos
    if topic.direction != "subscribe":
        return
    silence = "a supervisor's rule notices silence whoever publishes"
    if qos.deadline_ms:
        whom = f"a publisher that promises no deadline of {qos.deadline_ms:g} ms or less, as nearly all"
        yield "deadline_ms", whom, f"leave it out; {silence}"
    if qos.lease_ms:
        whom = f"a publisher that promises no liveliness lease of {qos.lease_ms:g} ms or less, as nearly all"
        yield "lease_ms", whom, f"leave it out; {silence}"
    if qos.liveliness == "manual_by_topic":
        whom = "a publisher that does not assert its own liveliness, as nearly all"
        yield "liveliness", whom, "leave it out: automatic matches every publisher"
    if (qos.durability or qos.profile) == "transient_local":
        key = "durability" if qos.durability else "profile"
        whom = "a publisher that keeps no messages for late joiners (volatile, the default)"
        yield key, whom, "say volatile, unless its publisher is transient_local, such as that of a map"


def remark_text(name: str, topic: TopicModel, remark: tuple[str, str, str]) -> str:
    """One line about a resource's topic."""
    key, whom, remedy = remark
    return f"topic '{topic.name}' of resource '{name}' will not receive, by its {key}, {whom}; {remedy}"


def file_warnings(model: ArchitectureModel) -> Iterator[Problem]:
    """A remark for each such request in a file, at its place. The file can be used all the same."""
    for name, resource in model.resources.items():
        if resource.topic is not None:
            for remark in qos_remarks(resource.topic):
                place = ("resources", name, "topic", "qos", remark[0])
                yield model.key_problem(place, remark_text(name, resource.topic, remark))
