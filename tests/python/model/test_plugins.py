"""The ament index of plug-ins: parsing, order of search, loading on demand."""

from pathlib import Path

import pytest

from mauve_rt._kernel import PluginRegistry
from mauve_rt.errors import PluginError
from mauve_rt.model.plugins import PluginIndex, PluginLoader, parse_index
from mauve_rt.parts.ament_index import prefixes, share_folder

PREFIX = Path("/opt/somewhere")
INDEX = """\
# kind; name; shell; library or module:Class
shell; p/Shell; ; p_components

core; p/Core; p/Shell; p_components   # a remark
core;p/PyCore;p/Shell;p.cores:Core
"""


def _install(prefix: Path, package: str, text: str) -> None:
    folder = prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / package).write_text(text, encoding="utf-8")


def test_lines_of_an_index() -> None:
    plugins, complaints = parse_index(INDEX, prefix=PREFIX, origin="p")
    assert [(plugin.kind, plugin.name, plugin.shell) for plugin in plugins] == [
        ("shell", "p/Shell", ""),
        ("core", "p/Core", "p/Shell"),
        ("core", "p/PyCore", "p/Shell"),
    ]
    assert complaints == []
    assert plugins[1].library == PREFIX / "lib" / "libp_components.so"
    assert [plugin.is_python for plugin in plugins] == [False, False, True]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("core; p/Core; p/Shell", "p:1:1: expected 'kind; name; shell; library or module:Class', found"),
        ("kore; p/Core; p/Shell; p", "p:1:1: unknown kind 'kore'; did you mean core?"),
        ("core; p/Core; ; p", "p:1:1: a core needs a name"),
        ("shell; ; ; p", "p:1:1: a shell needs a name"),
        (
            "type; p/Type; ; p.module:Type",
            "p:1:1: a type is written in C++: expected a library, found 'p.mod",
        ),
    ],
)
def test_bad_lines_are_told_and_left_out(line: str, message: str) -> None:
    plugins, complaints = parse_index(line, prefix=PREFIX, origin="p")
    assert plugins == []
    assert complaints[0].startswith(message)


def test_overlay_hides_the_package_below(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    over, under = tmp_path / "over", tmp_path / "under"
    _install(over, "p", "core; p/Core; p/Shell; new")
    _install(under, "p", "core; p/Core; p/Shell; old\ncore; p/Gone; p/Shell; old")
    _install(under, "q", "core; q/Core; p/Shell; q\nnonsense")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{over}:{under}")
    index = PluginIndex.installed()
    found = index.find("core", "p/Core")
    assert found is not None
    assert found.target == "new"
    assert index.find("core", "p/Gone") is None
    assert {"p/Core", "q/Core"} <= set(index.names("core"))
    assert any(f"{under}/share" in complaint and "nonsense" in complaint for complaint in index.complaints)
    assert prefixes()[:2] == [over, under]


def test_a_type_of_several_packages_is_loaded_from_mauve_rt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _install(tmp_path, "a_robot", "type; p/Number; ; a_robot\ntype; p/Own; ; a_robot\n")
    _install(tmp_path, "mauve_rt", "type; p/Number; ; mauve_rt_elements\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    index = PluginIndex.installed()
    assert {plugin.name: plugin.target for plugin in index} == {
        "p/Number": "mauve_rt_elements",
        "p/Own": "a_robot",
    }


def test_share_folder(plugin_prefix: Path) -> None:
    assert share_folder("executor_tests") == plugin_prefix / "share" / "executor_tests"
    assert share_folder("no_such_package") is None


def test_libraries_are_loaded_when_asked_for(plugin_prefix: Path) -> None:
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    assert registry.names("core") == []
    loader.require("core", "executor_tests/Counter")
    assert "executor_tests/Counter" in registry.names("core")
    assert registry.core_shell("executor_tests/Counter") == "executor_tests/CounterShell"
    loader.require("core", "executor_tests/PyCounter")
    assert registry.core_shell("executor_tests/PyCounter") == "executor_tests/CounterShell"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("executor_tests/Countr", "is not installed; did you mean executor_tests/Counter?"),
        ("executor_tets/Counter", "is not installed; did you mean executor_tests/Counter?"),
        (
            "my_arm/Counter",
            "package 'my_arm' is not found; source its install/setup.bash",
        ),
        ("executor_tests/Missing", "has no core 'executor_tests/Missing'"),
        ("executor_tests/PyMissing", "cannot load executor_tests_cores:Nobody: AttributeError"),
    ],
)
def test_what_cannot_be_loaded(name: str, message: str, plugin_prefix: Path) -> None:
    with pytest.raises(PluginError) as caught:
        PluginLoader(PluginRegistry(), PluginIndex.installed()).require("core", name)
    assert message in str(caught.value)
    assert (caught.value.code, "\n" in str(caught.value)) == ("plugin", False)


def test_library_that_is_not_there(tmp_path: Path) -> None:
    plugins, _ = parse_index("core; p/Core; p/Shell; nothing", prefix=tmp_path, origin="p")
    with pytest.raises(PluginError, match=r"no library .*libnothing.so; build and install"):
        PluginLoader(PluginRegistry(), PluginIndex(plugins)).require("core", "p/Core")


def test_library_that_is_none(tmp_path: Path) -> None:
    plugins, _ = parse_index("core; p/Core; p/Shell; text", prefix=tmp_path, origin="p")
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libtext.so").write_text("not a library", encoding="utf-8")
    with pytest.raises(PluginError, match="does not load"):
        PluginLoader(PluginRegistry(), PluginIndex(plugins)).require("core", "p/Core")


def test_many_known_names_are_not_all_told(tmp_path: Path) -> None:
    names = [f"p/Core{number:02}" for number in range(99)]
    lines = "\n".join(f"core; {name}; p/Shell; p" for name in names)
    plugins, _ = parse_index(lines, prefix=tmp_path, origin="p")
    with pytest.raises(PluginError, match=r"known: p/Core00, .*, p/Core29 and 69 more \(`mauve plugins`"):
        PluginLoader(PluginRegistry(), PluginIndex(plugins)).require("core", "p/zzzzzzzzzzzzzzz")
