"""The keys of architecture files, from the sections of mauve_rt/model/schema.py."""

from _reference.tables import HEAD, section_table, setting_row, table
from mauve_rt.file_schema.section import Section
from mauve_rt.model import schema
from mauve_rt.model.resource_kinds import given_kinds, parameter_setting

# In the order of the page: the heading of each section, and where a file has it.
SECTIONS: dict[type[Section], tuple[str, str]] = {
    schema.FileModel: ("The file", "At the top level of the file."),
    schema.ExecutorModel: ("executor", "`executor:`"),
    schema.MirrorModel: ("mirror", "`executor: {mirror: [NAME, {...}]}`"),
    schema.SenderModel: ("sender", "`executor: {sender: {...}}`"),
    schema.DiagnosticsModel: (
        "diagnostics",
        "`diagnostics: {...}` of the executor or of a component. Figures since the last status.",
    ),
    schema.ThresholdModel: ("threshold", "`overruns: {warn: 1, error: 10}`. At least one of the two keys."),
    schema.ComponentModel: ("component", "`components: {NAME: {...}}`"),
    schema.StateModel: (
        "state",
        "`states: {NAME: {...}}` of a component. At least one key; `wcet_ns` is at most `max_execution_ns`.",
    ),
    schema.FramesModel: (
        "frames",
        "`frames: {PORT: FRAME}`, or `frames: {PORT: {...}}` of a component. At least one of the two keys.",
    ),
    schema.ResourceModel: (
        "resource",
        "`resources: {NAME: {...}}`. [The kind of the resource](#kinds-of-resources) adds keys of its own.",
    ),
    schema.TopicModel: ("topic", "`topic: {...}` of a resource."),
    schema.QosModel: ("qos", "`qos: PROFILE`, or `qos: {...}` of a topic."),
    schema.ServiceModel: ("service", "`service: {...}` of a resource."),
    schema.ActionModel: (
        "action",
        "`action: {...}` of a resource of kind `action_server` or `action_client`.",
    ),
}


def text() -> str:
    """All sections, then the kinds of resources."""
    links = {section: title.lower().replace(" ", "-") for section, (title, _) in SECTIONS.items()}
    parts = [
        f"## {title}\n\n{where}\n\n{section_table(section, links)}"
        for section, (title, where) in SECTIONS.items()
    ]
    return "\n".join([*parts, "## Kinds of resources\n", *map(_kind, given_kinds())])


def _kind(name: str) -> str:
    kind = given_kinds()[name]
    types = {
        "type": "a ROS message, or a type of a plug-in",
        "call_type": "a ROS service",
        "action_type": "a ROS action",
    }
    says = f"`type` is {types[kind.type_kind]}." if kind.type_kind else "The resource has no value."
    if kind.messages:
        says += " Its topic may carry " + ", ".join(f"`{each}`" for each in kind.messages) + "."
    if kind.has_one_writer:
        says += " Only one port, or one incoming topic, may write."
    own = [each for each in kind.parameters if each.file_key == each.name]
    rows = [setting_row(each.name, parameter_setting(each), {}, unit=each.unit) for each in own]
    for row, parameter in zip(rows, own, strict=True):
        row[4] = "required" if parameter.required else row[4]
    return "\n".join([f"### {name}\n", f"{says}\n", table(HEAD, rows) if rows else "It adds no key.\n"])
