"""Reloads: the steps that put rebuilt code in force, and the way back. Knows no ROS."""

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

from mauve_rt._kernel import ComponentDescription, Transaction
from mauve_rt.control.requests import BY_RELOAD, Code, RefusalError, ReloadOrder
from mauve_rt.control.runtime import Runtime
from mauve_rt.counts import counted
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.model import PluginLoader
from mauve_rt.model.code_layouts import shell_layout
from mauve_rt.model.generations import Generation, Name, Source, names_of
from mauve_rt.model.probation import Probation, read_probation
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.steps import Step
from mauve_rt.yaml.text import YamlError, read_yaml

_PARTS = ("shell", "fsm", "core")


@dataclass
class Reload:
    """One reload under way. Not thread-safe: changes are made one at a time."""

    runtime: Runtime
    order: ReloadOrder
    parts: Sequence[ComponentDescription]
    generation: Generation | None = None
    probation: Probation | None = None
    _shells: dict[str, list[object]] = field(default_factory=dict)  # layout by name, of the code of before
    _defaults: dict[str, dict[str, object]] = field(default_factory=dict)  # by shell, of the code of before

    def load(self, *, dry_run: bool) -> str:
        """Try the new code, load it and put it in force in the registry; or go back. Says what is to be done.

        Raises:
            RefusalError: a target is unknown, or there is no way back.
            PluginError: the new code cannot be loaded. Nothing has changed then.
        """
        self.probation = self._read_probation()
        with self.runtime.loading() as loader:
            chosen = self._chosen(loader)
        self._check_limits(names_of(chosen))
        with self.runtime.loading() as loader:
            if self.order.back:
                return self._go_back(loader, chosen, dry_run=dry_run)
            rebuilt = loader.generations.rebuilt(chosen)
            sources = [source for source in chosen if source.target in rebuilt]
            if not sources:
                return "no code was rebuilt since it was loaded; nothing has changed"
            names = names_of(sources)
            self._check_protected(names)
            self._note_defaults(loader, names)
            self.generation = loader.reload(sources, in_use=self._in_use(), dry_run=dry_run)
            files = sorted({str(file) for found in rebuilt.values() for file in found})
            return f"changed: {', '.join(files)}" if files else "forward again"

    def steps(self) -> tuple[list[Step], Transaction]:
        """What replaces every part of a component that the generation has anew."""
        steps: list[Step] = []
        transaction = Transaction()
        names = self.generation.names if self.generation is not None else frozenset()
        for part in self.parts:
            if not {*self._names_of(part)} & names:
                continue
            used = [kind for kind in _PARTS if (kind, getattr(part, kind)) in names]
            if "shell" in used and "core" not in used and self._is_python("core", part.core):
                used.append("core")  # it is made for one shell object
            if self.probation is not None:
                used = self._on_probation(part, used)
            for kind in used or ["core"]:  # of the fallback alone: it is made anew with the core
                steps.append(Step(f"replace_{kind}", part.name, getattr(part, kind)))
                if kind == "core" and self.probation is not None:
                    ports = self.runtime.registry.describe_shell(part.shell).ports
                    transaction.replace_core(part.name, part.core, self.probation.options(part.name, ports))
                else:
                    transaction.add(steps[-1].kind, part.name, steps[-1].name)
            for name, value in self._new_defaults(part).items() if "shell" in used else ():
                steps.append(Step("set_property", part.name, name, json.dumps(value)))
                transaction.add("set_property", part.name, name, value)
        return steps, transaction

    def undo(self) -> None:
        """The change was refused: the code of before is in force."""
        if self.generation is None:
            return
        with self.runtime.loading() as loader:
            if self.order.back:
                loader.generations.go_back(self.generation, loader.registry)  # exchanged once more
            else:
                loader.generations.undo(self.generation, loader.registry)

    def commit(self) -> None:
        """The new parts run."""
        if self.generation is None:
            return
        with self.runtime.loading() as loader:
            if self.order.back:
                loader.generations.went_back(self.generation)
            else:
                loader.generations.commit(self.generation)
        self.runtime.loaded_anew()

    def message(self, steps: Sequence[Step]) -> str:
        """What was done, in one line."""
        if self.generation is None:
            return ""
        components = list(dict.fromkeys(step.target for step in steps))
        what = f"generation {self.generation.number}"
        if self.order.back:
            what = f"the code before {what} is in force again"
        else:
            what += " is in force"
        verb = "runs" if len(components) == 1 else "run"
        runs = (
            f"{counted(len(components), 'component')} {verb} it: {', '.join(components)}"
            if components
            else ""
        )
        kept = [
            resource.name
            for resource in self.runtime.described_resources()
            if ("resource", resource.kind) in self.generation.names
        ]
        late = [name for _, name in self.generation.outdated]
        waits = f"not usable until they are built and reloaded, too: {', '.join(late)}" if late else ""
        trial = f"on probation for {self.probation.duration_s:g} s" if self.probation is not None else ""
        stays = f"resources keep the code that they were made with: {', '.join(kept)}" if kept else ""
        return "; ".join(
            text for text in (what, runs or "no component has a part of it", trial, stays, waits) if text
        )

    def _read_probation(self) -> Probation | None:
        if not self.order.probation:
            return None
        try:
            return read_probation(read_yaml(self.order.probation))
        except (YamlError, ValueError) as error:
            raise RefusalError(Code.INVALID, f"probation: {error}") from None

    def _check_limits(self, names: Collection[Name]) -> None:
        """That each limit of the probation is one of an output: before the new code is tried."""
        if self.probation is None or all(isinstance(each, str) for each in self.probation.revert_on):
            return
        changed = [part for part in self.parts if {*self._names_of(part)} & {*names}]
        ports = {part.name: self.runtime.registry.describe_shell(part.shell).ports for part in changed}
        try:
            self.probation.require_outputs(ports)
        except ValueError as error:
            raise RefusalError(Code.INVALID, f"probation: {error}") from None
        transaction = Transaction()
        for part in changed:
            options = self.probation.options(part.name, ports[part.name])
            transaction.replace_core(part.name, part.core, options)
        self.runtime.host.make(transaction, dry_run=True)

    def _on_probation(self, part: ComponentDescription, used: list[str]) -> list[str]:
        """The shell stays, which the old core goes back to."""
        if "shell" in used:
            now = self.runtime.registry.describe_shell(part.shell)
            layout, defaults = shell_layout(now), {item.name: item.value for item in now.properties}
            if (layout, defaults) != (self._shells[part.shell], self._defaults[part.shell]):
                text = f"component '{part.name}': shell {part.shell} has changed"
                remedy = "reload it without probation"
                raise RefusalError(Code.INVALID, f"{text}, so that the old core could not go back; {remedy}")
        return [kind for kind in ("fsm", "core") if kind in used or kind == "core"]

    def _note_defaults(self, loader: PluginLoader, names: Collection[Name]) -> None:
        for kind, name in names:
            if kind == "shell" and name in loader.registry.names("shell"):
                shell = loader.registry.describe_shell(name)
                self._defaults[name] = {item.name: item.value for item in shell.properties}
                self._shells[name] = shell_layout(shell)

    def _new_defaults(self, part: ComponentDescription) -> dict[str, PropertyValue]:
        """Properties that were never set, and that have another default in the new shell."""
        before = self._defaults.get(part.shell, {})
        present = {item.name: item.value for item in part.properties}
        declared = self.runtime.declared(part.name)
        chosen = {*(declared.properties if declared is not None else ())}
        authors = self.runtime.authors().get(part.name, {})
        chosen |= {
            element.removeprefix("property ")
            for element, author in authors.items()
            if not author.startswith(BY_RELOAD)
        }
        return {
            item.name: item.value
            for item in self.runtime.registry.describe_shell(part.shell).properties
            if item.name in before
            and item.name not in chosen
            and present.get(item.name) == before[item.name] != item.value
        }

    def _go_back(self, loader: PluginLoader, chosen: Sequence[Source], *, dry_run: bool) -> str:
        generation = loader.generations.last({source.target for source in chosen})
        if generation is None or self.order.generation not in (0, generation.number):
            raise RefusalError(Code.INVALID, "there is no generation to go back from; nothing was reloaded")
        self._check_protected(generation.names)
        self._note_defaults(loader, generation.names)
        if not dry_run:
            self.generation = generation
            loader.generations.go_back(generation, loader.registry)
        return f"back from generation {generation.number}"

    def _is_python(self, kind: str, name: str) -> bool:
        plugin = self.runtime.index.find(kind, name)
        return plugin is not None and plugin.is_python

    def _chosen(self, loader: PluginLoader) -> list[Source]:
        sources = loader.loaded_sources()
        if not self.order.targets:
            return sources
        known = {part.name: part for part in self.parts}
        packages = {name.partition("/")[0] for _, name in names_of(sources)}
        wanted: set[Name] = set()
        for target in self.order.targets:
            if target in known:
                wanted |= {*self._names_of(known[target])}
            elif target in packages:
                wanted |= {name for name in names_of(sources) if name[1].startswith(f"{target}/")}
            else:
                text = f"{shown(target)} is no component, and no package with code that is loaded"
                raise RefusalError(
                    Code.INVALID, f"{text}; {did_you_mean(target, [*known, *sorted(packages)])}"
                )
        return [source for source in sources if source.names & wanted]

    def _in_use(self) -> set[Name]:
        return {name for part in self.parts for name in self._names_of(part)}

    def _names_of(self, part: ComponentDescription) -> Iterator[Name]:
        yield from ((kind, getattr(part, kind)) for kind in _PARTS)
        declared = self.runtime.declared(part.name)
        if declared is not None and declared.fallback:
            yield "core", declared.fallback

    def _check_protected(self, names: Collection[Name]) -> None:
        for part in self.parts:
            if not part.reconfigurable and {*self._names_of(part)} & {*names}:
                text = f"component '{part.name}' has a part of this code, and is protected"
                raise RefusalError(Code.NOT_RECONFIGURABLE, f"{text} (reconfigurable: false)")
