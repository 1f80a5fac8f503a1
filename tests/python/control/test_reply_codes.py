"""Reply codes: the constants of a message, and the kernel's table of which error is answered with which."""

import re
from importlib.resources import files
from pathlib import Path

import pytest

import mauve_msgs.srv
from mauve_msgs.msg import ReplyCode
from mauve_rt._kernel import ERROR_REPLIES
from mauve_rt.control.requests import Code, code_name, code_of
from mauve_rt.errors import PluginError

SOURCES = sorted(Path(str(files("mauve_rt"))).rglob("*.py"))


def test_codes_are_the_constants_of_the_message():
    constants = {name: value for name, value in vars(ReplyCode).items() if isinstance(value, int)}
    assert {each.name: each.value for each in Code} == constants
    assert [*Code] == [*range(len(Code))], "numbers that clients know: new ones come at the end"


def test_each_error_of_the_kernel_is_answered_with_a_code_that_there_is():
    assert {"timeout", "structural_property", "internal"} < set(ERROR_REPLIES)
    assert set(ERROR_REPLIES.values()) <= set(Code.__members__)
    assert "OK" not in ERROR_REPLIES.values()


def test_each_code_that_the_sources_name_is_there():
    named = {name for path in SOURCES for name in re.findall(r"\bCode\.([A-Z_]+)\b", path.read_text())}
    assert {"INVALID", "WRONG_REVISION"} < named <= set(Code.__members__)


SERVICES = [name for name in vars(mauve_msgs.srv) if name[0].isupper() and "_" not in name]


@pytest.mark.parametrize("name", SERVICES)
def test_services_have_no_codes_of_their_own(name: str):
    response = getattr(mauve_msgs.srv, name).Response
    assert [word for word, value in vars(response).items() if isinstance(value, int)] == []


def test_an_error_has_the_code_of_the_table():
    assert code_of(PluginError("it cannot be loaded")) is Code.PREPARE_FAILED
    assert code_of(ValueError("not ours")) is Code.PREPARE_FAILED


def test_a_code_of_a_newer_executor_is_shown_as_its_number():
    assert (code_name(14), code_name(999)) == ("INVALID", "999")
