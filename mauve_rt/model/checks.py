"""What an architecture file says, held against the plug-ins it names."""

from collections.abc import Iterable, Iterator, Mapping
from functools import cache

from mauve_rt._kernel import (
    PortDescription,
    PropertyDescription,
    ResourceDescription,
    ServiceDescription,
    ShellDescription,
)
from mauve_rt.errors import ArchitectureFileError, MauveError, PluginError, PortTypeError, Problem
from mauve_rt.file_schema.kinds import Faults
from mauve_rt.file_schema.schema_errors import fault_problem
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.model.architecture_file import ArchitectureModel, Connection
from mauve_rt.model.message_shapes import REMEDY, message_definition, mismatches
from mauve_rt.model.plugins import SOURCE_IT, PluginLoader
from mauve_rt.model.resource_kinds import EXAMPLES_OF_TYPES, capacities, given_kinds, read_parameters
from mauve_rt.model.resource_parts import describe_resource
from mauve_rt.model.schema import PropertyValue, ResourceModel
from mauve_rt.parts.message_types import action_class, is_message, service_class


class Checks:
    """One pass over a model; loads the plug-ins that it names."""

    def __init__(self, model: ArchitectureModel, loader: PluginLoader) -> None:
        self._model = model
        self._loader = loader
        self._shells: dict[str, ShellDescription] = {}  # by component
        self._described: dict[str, ShellDescription] = {}  # by the shell's name: described and checked once
        self._resources: dict[str, ResourceDescription] = {}
        self._unlike: set[str] = set()  # types that were told to differ from their messages
        self._absent: set[str] = set()  # what was told about packages that are not found
        # A message is looked up in the ament index's files: once for all ports of its type.
        self._message_definition = cache(message_definition)

    def problems(self) -> list[Problem]:
        """Everything wrong; empty: the architecture can be built."""
        found: list[Problem] = []
        for component in self._model.components:
            found += self._component(component)
            found += self._properties(component)
            found += self._frames(component)
            found += self._max_slew(component)
        for resource in self._model.resources:
            found += self._resource(resource)
        for connection in self._model.connections:
            found += self._connection(connection)
        return [*self._each_package_once(found)]

    def _each_package_once(self, problems: Iterable[Problem]) -> Iterator[Problem]:
        """A package that is not sourced is one problem, however many of its parts the file names."""
        told: set[str] = set()
        for problem in problems:
            if problem.what not in told:
                yield problem
            if problem.what in self._absent:
                told.add(problem.what)

    def _absence(self, kind: str, name: str, place: Location) -> Problem | None:
        """Of the package of a plug-in or type."""
        if not (what := self._loader.missing_package(name)):
            return None
        self._absent.add(what)
        return self._model.problem(place, what, remedy=SOURCE_IT, code=f"unknown_{kind}")

    def _component(self, name: str) -> Iterator[Problem]:
        component = self._model.components[name]
        place: Location = ("components", name)
        registry = self._loader.registry
        missing = [*self._plugin("shell", component.shell, (*place, "shell"))]
        yield from missing
        if not missing:
            shell = self._described.get(component.shell)
            if shell is not None:
                self._shells[name] = shell
            else:
                shell = registry.describe_shell(component.shell)
                self._shells[name] = self._described[component.shell] = shell
                yield from self._structs(shell.ports, (*place, "shell"))
        for kind, plugin, written_for in (
            ("core", component.core, registry.core_shell),
            ("fsm", component.fsm, registry.fsm_shell),
        ):
            missing = [*self._plugin(kind, plugin, (*place, kind))]
            yield from missing
            if not missing:
                yield from self._same_shell(name, plugin, written_for(plugin), (*place, kind))
        if component.fallback is not None:
            missing = [*self._plugin("core", component.fallback, (*place, "fallback"))]
            yield from missing
            if not missing:
                written_for_shell = registry.core_shell(component.fallback)
                yield from self._same_shell(name, component.fallback, written_for_shell, (*place, "fallback"))
        yield from self._alternatives(name, place)

    def _alternatives(self, name: str, place: Location) -> Iterator[Problem]:
        """Cores and fsms may be for another shell where that is an alternative too."""
        component = self._model.components[name]
        registry = self._loader.registry
        names = component.alternatives if isinstance(component.alternatives, list) else []
        shells = [other for other in names if "shell" in self._loader.part_kinds(other)]
        for index, part in enumerate(names):
            at = (*place, "alternatives", index)
            for kind in self._loader.part_kinds(part) or ["core"]:
                missing = [*self._plugin(kind, part, at)]
                yield from missing
                if missing or kind == "shell":
                    continue
                shell = registry.core_shell(part) if kind == "core" else registry.fsm_shell(part)
                if shell not in shells:
                    yield from self._same_shell(name, part, shell, at)
                if kind == "core":
                    yield from self._served(name, part, shell, at)

    def _served(self, component: str, core: str, shell: str, place: Location) -> Iterator[Problem]:
        """Ports that an alternative in Python cannot use; of the first core configure() tells."""
        plugin = self._loader.index.find("core", core)
        ports = self._shells[component].ports if component in self._shells else []
        if plugin is None or not plugin.is_python or shell != self._model.components[component].shell:
            return
        for port in ports:
            if port.kind in ("read", "write") and port.required and not is_message(port.type):
                error = PortTypeError(port.name, port.type, core=f"'{core}'")
                yield self._model.problem(place, str(error), code=error.code)

    def _plugin(self, kind: str, name: str, place: Location) -> Iterator[Problem]:
        try:
            self._loader.require(kind, name)
        except PluginError as error:
            absence = self._absence(kind, name, place)
            yield absence or self._model.problem(place, str(error), code=f"unknown_{kind}")

    def _same_shell(self, component: str, plugin: str, shell: str, place: Location) -> Iterator[Problem]:
        wanted = self._model.components[component].shell
        if shell != wanted and component in self._shells:
            what = f"'{plugin}' does not fit component '{component}'"
            expected, found = f"one written for shell {wanted}", f"one for {shell}"
            yield self._model.problem(place, what, expected=expected, found=found, code="type_mismatch")

    def _properties(self, name: str) -> Iterator[Problem]:
        shell = self._shells.get(name)
        if shell is None:
            return
        known = {description.name: description for description in shell.properties}
        try:
            values = self._model.properties(name)
        except ArchitectureFileError as error:
            yield from error.problems
            return
        for key, value in values.items():
            place = self._model.property_place(name, key)
            if key not in known:
                what = f"unknown {self._model.property_words(name, key)}"
                remedy = did_you_mean(key, known)
                yield self._model.key_problem(place, what, remedy=remedy, code="unknown_property")
            elif facts := property_mismatch(known[key], value):
                yield self._model.problem(place, f"bad {self._model.property_words(name, key)}", **facts)

    def _frames(self, name: str) -> Iterator[Problem]:
        """Frames of ports that there are not, or that the code of the shell declares otherwise."""
        shell = self._shells.get(name)
        if shell is None:
            return
        try:
            frames = self._model.frames(name)
        except ArchitectureFileError as error:
            yield from error.problems
            return
        ports = {port.name: port for port in shell.ports if port.kind in ("read", "write")}
        for key, declared in frames.items():
            place: Location = ("components", name, "frames", key)
            if key not in ports:
                what = f"component '{name}' has no port '{key}' that reads or writes values"
                remedy = did_you_mean(key, ports)
                yield self._model.key_problem(place, what, remedy=remedy, code="unknown_port")
                continue
            own = ports[key].frame, ports[key].child_frame
            for word, found, expected in zip(("frame", "child_frame"), declared, own, strict=True):
                if found and expected and found != expected:
                    yield self._model.problem(
                        place,
                        f"the shell of '{name}' declares another {word} for port '{key}'",
                        expected=expected,
                        found=found,
                        remedy="remove it from the file, or correct the code of the shell",
                        code="frame_mismatch",
                    )

    def _max_slew(self, name: str) -> Iterator[Problem]:
        """Numbers that the component does not write."""
        if name not in self._shells:
            return
        for output, per_second in self._model.components[name].max_slew.items():
            try:
                self._loader.registry.check_max_slew(self._shells[name].name, {output: per_second})
            except MauveError as error:
                yield self._model.key_problem(
                    ("components", name, "max_slew", output),
                    error.statement,
                    expected=error.expected,
                    found=error.found,
                    remedy=error.remedy,
                    code=error.code,
                )

    def _resource(self, name: str) -> Iterator[Problem]:
        resource = self._model.resources[name]
        place: Location = ("resources", name)
        try:
            self._model.resource_frames(name)
        except ArchitectureFileError as error:
            yield from error.problems
            return
        try:
            if resource.kind not in given_kinds():
                wrong = [*self._plugin("resource", resource.kind, (*place, "kind"))]
                wrong = wrong or self._parameters(resource, place)
                yield from wrong
                if wrong:
                    return
            type_kind = self._loader.registry.resource_kind(resource.kind).type_kind or "type"
            if resource.type:
                self._loader.require_type(resource.type, type_kind)
            self._resources[name] = describe_resource(resource, self._loader.registry)
        except MauveError as error:
            about = "type" if resource.type else "kind"
            is_unknown = error.code == "unknown_type"
            if is_unknown and (absence := self._absence("type", resource.type, (*place, about))):
                yield absence
                return
            what = f"bad {about} '{resource.type or resource.kind}' of resource '{name}': {error}"
            remedy = did_you_mean(resource.type, self._loader.names(type_kind)) if is_unknown else ""
            yield self._model.problem((*place, about), what, remedy=remedy, code=error.code)
            return
        if resource.topic is not None and not is_message(self._resources[name].type):
            what = (
                f"resource '{name}' is bound to topic '{resource.topic.name}', but its type is no ROS message"
            )
            expected = f"an installed message type such as {EXAMPLES_OF_TYPES['type']}"
            found = shown(self._resources[name].type)
            yield self._model.key_problem((*place, "topic"), what, expected=expected, found=found)
        at = (*place, "type" if resource.type else "kind")
        yield from self._structs(self._resources[name].services, at)
        yield from self._capacities(name)
        yield from self._service(name)
        yield from self._action(name)

    def _parameters(self, resource: ResourceModel, place: Location) -> list[Problem]:
        """What is wrong with the parameters of a plug-in's kind; of a given one's the file told."""
        faults: Faults = []
        kind, keys = self._loader.registry.resource_kind(resource.kind), tuple(resource.settings)
        read_parameters(kind, resource.parameters, place, faults, others=keys)
        return [fault_problem(self._model.file, fault) for fault in faults]

    def _structs(
        self, carriers: Iterable[PortDescription | ServiceDescription], place: Location
    ) -> Iterator[Problem]:
        """C++ structs that are not what the ROS messages of their names are; each once."""
        for carrier in carriers:
            for found in mismatches(carrier.messages, find=self._message_definition):
                if found.type in self._unlike:
                    continue
                self._unlike.add(found.type)
                facts = {"expected": found.expected, "found": found.found, "remedy": REMEDY}
                yield self._model.problem(place, found.what, **facts, code="type_mismatch")

    def _capacities(self, name: str) -> Iterator[Problem]:
        """Whether each sequence of a resource's type has its capacity."""
        resource = self._model.resources[name]
        try:
            self._loader.registry.value_bytes(resource.type, capacities(resource.parameters))
        except MauveError as error:
            what = f"resource '{name}': {error.statement}, at {error.element}"
            facts = {"expected": error.expected, "found": error.found, "remedy": error.remedy}
            yield self._model.problem(("resources", name), what, **facts, code=error.code)

    def _service(self, name: str) -> Iterator[Problem]:
        """The ROS service that a resource calls or offers."""
        service, described = self._model.resources[name].service, self._resources[name]
        if service is None:
            return
        place: Location = ("resources", name, "service")
        service_type, calls = described.type, {each.name: each for each in described.services}
        if service.offers is not None:
            offered = calls.get(service.offers)
            if offered is None or not offered.takes_messages:
                what = f"resource '{name}' cannot offer '{service.offers}' as a ROS service"
                fitting = [each.name for each in described.services if each.takes_messages]
                expected = "one of its calls with a ROS type"
                found = shown(offered.type) if offered else f"no service '{service.offers}'"
                remedy = did_you_mean(service.offers, fitting) if fitting else "it has none"
                at = (*place, "offers")
                yield self._model.problem(at, what, expected=expected, found=found, remedy=remedy)
                return
            service_type = offered.type
        if service_class(service_type) is None:
            what = f"resource '{name}' is bound to service '{service.name}', but its type is no ROS service"
            expected = f"an installed service type such as {EXAMPLES_OF_TYPES['call_type']}"
            yield self._model.key_problem(place, what, expected=expected, found=shown(service_type))

    def _action(self, name: str) -> Iterator[Problem]:
        """The ROS action that a resource uses or offers."""
        resource = self._model.resources[name]
        if resource.action is not None and action_class(resource.type) is None:
            what = f"resource '{name}' has action '{resource.action.name}', but its type is no ROS action"
            expected = f"an installed action type such as {EXAMPLES_OF_TYPES['action_type']}"
            place = ("resources", name, "action")
            yield self._model.key_problem(place, what, expected=expected, found=shown(resource.type))

    def _connection(self, connection: Connection) -> Iterator[Problem]:
        shell = self._shells.get(connection.component)
        resource = self._resources.get(connection.resource)
        at_port, at_service = (*connection.location, 0), (*connection.location, 1)
        ports = {port.name: port for port in shell.ports} if shell else {}
        services = {service.name: service for service in resource.services} if resource else {}
        if shell and connection.port not in ports:
            what = f"component '{connection.component}' has no port '{connection.port}'"
            yield self._model.problem(
                at_port, what, remedy=did_you_mean(connection.port, ports), code="unknown_port"
            )
        if resource and connection.service not in services:
            what = f"resource '{connection.resource}' has no service '{connection.service}'"
            remedy = did_you_mean(connection.service, services)
            yield self._model.problem(at_service, what, remedy=remedy, code="unknown_service")
        port, service = ports.get(connection.port), services.get(connection.service)
        if resource and port and service and (port.kind, port.type) != (service.kind, service.type):
            shell_port = f"{connection.component}.{port.name}"
            fitting = [
                other.name
                for other in resource.services
                if (other.kind, other.type) == (port.kind, port.type)
            ]
            yield self._model.problem(
                at_service,
                f"port '{shell_port}' does not fit '{connection.resource}.{service.name}'",
                expected=f"a service of {_signature(port)}",
                found=f"one of kind {service.kind} and type {service.type}",
                remedy=f"connect it to {connection.resource}.{fitting[0]}" if fitting else "",
                code="type_mismatch",
            )


def property_mismatch(known: PropertyDescription, value: PropertyValue) -> Mapping[str, str]:
    """Expected and found where the kernel would not take a value for a property; empty where it would."""
    if known.type in ("int", "float") and isinstance(value, int) and not -(2**63) <= value < 2**63:
        return {"expected": "a number of at most 64 bits", "found": shown(value), "code": "out_of_range"}
    try:
        known.check(value)
    except MauveError as error:
        found = error.found if error.code == "out_of_range" else shown(value)
        return {"expected": error.expected, "found": found, "remedy": error.remedy, "code": error.code}
    return {}


def _signature(port: PortDescription) -> str:
    return f"kind {port.kind} and type {port.type}"
