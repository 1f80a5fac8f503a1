"""The keys of model files, from the sections of mauve_rt/modelling/schema.py."""

from _reference.tables import section_table
from mauve_rt.file_schema.section import Section
from mauve_rt.modelling import schema

# In the order of the page: the heading of each section, and where a file has it.
SECTIONS: dict[type[Section], tuple[str, str]] = {
    schema.ModelFile: ("The file", "At the top level of the file."),
    schema.CppType: ("type in C++", "`types: {NAME: {...}}` of a struct that exists in C++."),
    schema.ShellModel: ("shell", "`shells: {NAME: {...}}`"),
    schema.PropertyModel: ("property", "`properties: {NAME: {...}}` of a shell."),
    schema.PortModel: ("port", "`ports: {NAME: {...}}` of a shell. One of read, write, call and event."),
    schema.CppCall: ("call in C++", "`call: {...}` of a port or a service, where no message describes it."),
    schema.CoreModel: ("core", "`cores: {NAME: {...}}`"),
    schema.HandoverModel: ("handover", "`handover: {...}` of a core."),
    schema.ImplementationModel: ("implementation", "`implementations: {NAME: {...}}` of a core."),
    schema.FsmModel: ("fsm", "`fsms: {NAME: {...}}`"),
    schema.StateModel: ("state", "`states: {NAME: {...}}` of an fsm. One of run, wait and wait_event."),
    schema.EventModel: ("wait for an event", "`wait_event: {...}` of a state."),
    schema.ResourceModel: ("resource", "`resources: {NAME: {...}}`"),
    schema.ServiceModel: ("service", "`services: {NAME: {...}}` of a resource."),
    schema.ParameterModel: ("parameter", "`parameters: {NAME: {...}}` of a resource."),
}


def text() -> str:
    """All sections."""
    links = {section: title.lower().replace(" ", "-") for section, (title, _) in SECTIONS.items()}
    parts = [
        f"## {title}\n\n{where}\n\n{section_table(section, links)}"
        for section, (title, where) in SECTIONS.items()
    ]
    return "\n".join(parts)
