"""`mauve doctor` as a user runs it: on this computer, about a running executor, and in a bare environment."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from mauve_rt.doctor.checks import CHECKS
from mauve_rt.doctor.network import exchange

NODE = "/robot_1/executor"
NEEDED = ("PYTHONPATH", "LD_LIBRARY_PATH")
Doctor = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def doctor(domain: int) -> Doctor:
    def run(*words: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
        environment = dict(os.environ) if environment is None else environment
        return subprocess.run(
            [sys.executable, "-m", "mauve_rt.cli", "doctor", *words],
            env={**environment, "ROS_DOMAIN_ID": str(domain)},
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )

    return run


def _by_name(output: str) -> dict[str, list[dict[str, str]]]:
    names: dict[str, list[dict[str, str]]] = {}
    for finding in json.loads(output)["findings"]:
        names.setdefault(finding["name"], []).append(finding)
    return names


def test_each_check_has_a_line_and_the_figures_are_in_the_json(doctor: Doctor) -> None:
    done = doctor("--json", "--seconds", "0.5")
    assert done.stderr == ""
    told = json.loads(done.stdout)
    names = _by_name(done.stdout)
    assert {check.name for check in CHECKS} | {"executors", "wake-up test"} == names.keys()
    statuses = {finding["status"] for finding in told["findings"]}
    assert statuses <= {"ok", "warning", "error"}
    assert done.returncode == (1 if "error" in statuses else 0)
    assert told["wakeup"]["wakeup_us"] > 0
    assert told["wakeup"]["cpus"][0]["count"] > 0
    [discovery] = names["discovery"]
    assert discovery["status"] == "ok", discovery


def test_the_report_is_one_line_a_check(doctor: Doctor) -> None:
    done = doctor("--seconds", "0")
    assert done.returncode in (0, 1), done.stderr
    for check in CHECKS:
        assert f" {check.name} " in done.stdout
    assert "CPU 0" not in done.stdout
    assert "\x1b" not in done.stdout  # a pipe


@pytest.mark.parametrize("kept", [(), ("HOME",)])
def test_a_bare_environment_has_findings_and_no_traceback(doctor: Doctor, kept: tuple[str, ...]) -> None:
    done = doctor(
        "--json", "--seconds", "0.2", environment={name: os.environ[name] for name in (*NEEDED, *kept)}
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr == ""
    names = _by_name(done.stdout)
    assert {check.name for check in CHECKS} <= names.keys()
    assert names["plug-in index"][0]["found"] == "no package lists plug-ins"
    assert names["wake-up test"][0]["status"] == "warning"


@pytest.mark.parametrize(
    ("variable", "value", "check"),
    [
        ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp", "middleware"),
        ("ROS_DISTRO", "humble", "ROS distribution"),
    ],
)
def test_what_ends_other_programs_is_an_error_and_the_report_goes_on(
    doctor: Doctor, variable: str, value: str, check: str
) -> None:
    done = doctor("--json", "--seconds", "0", environment={**os.environ, variable: value})
    assert done.returncode == 1, done.stderr
    names = _by_name(done.stdout)
    assert [each["status"] for each in names[check]] == ["error"]
    assert names.keys() >= {each.name for each in CHECKS} | {"executors"}


def test_an_executor_is_asked_for_its_own_state(doctor: Doctor, executor: Any) -> None:
    names = _by_name(doctor(NODE, "--json", "--seconds", "0").stdout)
    assert NODE in names["executors"][0]["found"].split(", ")
    assert any(each["found"].startswith("3 components, revision") for each in names[NODE])
    assert f"process {executor.process.pid} in domain" in names["executor processes"][-1]["found"]
    assert names["participants"][0]["found"] != "no participant"
    assert "wake-up test" not in names


def test_an_executor_that_is_not_there_is_an_error(doctor: Doctor) -> None:
    done = doctor("/nowhere/executor", "--seconds", "0")
    assert done.returncode == 1
    assert "no executor /nowhere/executor" in done.stdout


@pytest.mark.parametrize("seconds", ["nan", "-1", "1e9"])
def test_a_test_of_no_length_is_bad_usage(doctor: Doctor, seconds: str) -> None:
    done = doctor(f"--seconds={seconds}")
    assert done.returncode == 2
    assert "--seconds: expected 0 to 86400" in done.stderr


def test_a_message_that_does_not_arrive_is_a_status(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")  # as where the loopback interface is down
    assert exchange(2.0) == (1, "", "")
