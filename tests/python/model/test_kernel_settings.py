"""Settings of a component: one table in the kernel, from which files, programs and descriptions have them."""

from typing import Any

import pytest
from python_parts import ActFsm, CountCore, CountShell

from mauve_rt._kernel import TASK_SETTINGS, Architecture, MauveError, PluginRegistry
from mauve_rt.file_schema.kinds import Faults
from mauve_rt.model.kernel_settings import KernelSetting
from mauve_rt.model.schema import ComponentModel

IN_FILES = {
    each.name: (key, each) for key, each in ComponentModel.settings.items() if isinstance(each, KernelSetting)
}
NUMBERS = sorted(
    name for name, told in TASK_SETTINGS.items() if not (told.choices or isinstance(told.default, bool))
)
FLAGS = sorted(name for name, told in TASK_SETTINGS.items() if isinstance(told.default, bool))


def add(**settings: Any) -> str:
    """The description of an architecture with such a component."""
    architecture = Architecture(PluginRegistry())
    architecture.add_component("c", CountShell, CountCore, ActFsm, **settings)
    return str(architecture.describe())


def test_files_have_every_setting_of_the_kernel():
    assert sorted(IN_FILES) == sorted(TASK_SETTINGS)


def test_descriptions_have_every_setting_of_the_kernel():
    lines = [line.split()[1] for line in add().splitlines() if line.startswith("  setting ")]
    assert lines == [*TASK_SETTINGS]


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("by", [-1, 1])
def test_a_file_and_the_kernel_refuse_the_same_numbers(name: str, by: int):
    told = TASK_SETTINGS[name]
    number = told.least - 1 if by < 0 else told.most + 1
    number -= number == told.default  # which stands for the kernel's own choice
    given = [number] if isinstance(told.default, list) else number
    with pytest.raises((MauveError, TypeError)) as refused:
        add(**{name: given})
    assert name in str(refused.value)
    key, setting = IN_FILES[name]
    if name == "cpus" and by > 0:
        return  # a file may not name one that the machine lacks either, in words of its own
    faults: Faults = []
    setting.read(number * 2 / 1e6 if key.endswith("_ms") else given, (key,), faults)
    assert len(faults) == 1


@pytest.mark.parametrize("name", NUMBERS)
def test_a_file_and_the_kernel_take_the_same_numbers(name: str):
    told = TASK_SETTINGS[name]
    key, setting = IN_FILES[name]
    for number in (told.least, told.most):
        if key.endswith("_ms") and number > 2**53:
            continue  # more digits than a file's milliseconds have
        given = [number] if isinstance(told.default, list) else number
        assert f"  setting {name} {number}\n" in add(**{name: given})
        faults: Faults = []
        read = setting.read(number / 1e6 if key.endswith("_ms") else given, (key,), faults)
        assert (faults, setting.to_kernel(read)) == ([], given)


@pytest.mark.parametrize("name", FLAGS)
@pytest.mark.parametrize("value", [True, False])
def test_a_file_and_the_kernel_take_the_same_flags(name: str, *, value: bool):
    setting = IN_FILES[name][1]
    faults: Faults = []
    assert setting.to_kernel(setting.read(value, (name,), faults)) is value
    assert f"  setting {name} {str(value).lower()}\n" in add(**{name: value})
    setting.read(1, (name,), faults)
    assert len(faults) == 1


@pytest.mark.parametrize(
    ("settings", "error", "words"),
    [
        ({"overrun": "skp"}, MauveError, "expected skip, catch_up, fault, found skp"),
        (
            {"stack_bytes": 65_535},
            MauveError,
            "stack_bytes: a setting of the task is out of range; expected 65536",
        ),
        ({"stack_bytes": 1.5}, TypeError, "stack_bytes"),
        ({"cpus": 1}, TypeError, "cpus"),
        ({"enforce_wcet": 1}, TypeError, "enforce_wcet: found <class 'int'>"),
        ({"colour": 1}, TypeError, "no argument 'colour'"),
    ],
)
def test_what_is_refused_is_named(settings: dict[str, Any], error: type[Exception], words: str):
    with pytest.raises(error, match=words):
        add(**settings)
