"""Kinds of steps are told once: the comment of the message and the kernel agree with the table."""

import re
from pathlib import Path

import pytest

from mauve_msgs.msg import StepReport
from mauve_rt.api import Architecture, MauveError, PluginRegistry, Transaction
from mauve_rt.control.requests import Report
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step

ROOT = Path(__file__).parents[3]


def _comments() -> dict[str, str]:
    """Of ReconfigurationStep.msg, by field."""
    text = (ROOT / "mauve_msgs" / "msg" / "ReconfigurationStep.msg").read_text(encoding="utf-8")
    fields = re.split(r"^string (\w+)", text, flags=re.MULTILINE)[1:]
    return {
        field: " ".join(re.findall(r"# (.*)", rest))
        for field, rest in zip(fields[::2], fields[1::2], strict=True)
    }


def test_the_message_names_all_kinds():
    assert _comments()["kind"].split(", ") == list(STEP_KINDS)


def test_the_message_says_of_which_kinds_there_is_a_value():
    told = [word for word in re.findall(r"\w+", _comments()["value"]) if word in STEP_KINDS]
    assert sorted(told) == sorted(name for name, kind in STEP_KINDS.items() if kind.value)


def test_the_kernel_has_each_kind():
    with pytest.raises(MauveError, match="no such kind of step") as refused:
        Architecture(PluginRegistry()).commit(Transaction().add("reset", "a"))
    known = re.findall(r"\w+", str(refused.value).partition("expected")[2].partition(";")[0])
    assert set(STEP_KINDS) == set(known) - {"place_core"}  # which takes an object only


def test_a_step_reads_as_it_is_told():
    assert str(Step("connect", "a", "port", "x.read")) == "connect a port x.read"
    assert Step("stop", "a") == Step(kind="stop", target="a")


def test_a_report_has_the_fields_of_its_message():
    told = StepReport(**vars(Report(step="stop", component="a")))
    assert set(vars(Report(step="stop", component="a"))) == set(told.get_fields_and_field_types())
