"""A program in Python ends in order while a state of a component still executes."""

import subprocess
import sys

import pytest

PROGRAM = """
import sys
import time

from mauve_rt.api import Architecture, Core, Deployer, Fsm, PluginRegistry, Shell, ms_to_ns

hangs = False


class Hanging(Core[Shell]):
    def step(self):
        until = time.monotonic() + 2.0
        while hangs and time.monotonic() < until:
            {state}


class Loop(Fsm[Shell, Hanging]):
    def define(self):
        step, rest = self.execution("Step", Hanging.step), self.wait("Rest", ms_to_ns(1))
        self.set_initial(step), self.next(step, rest), self.next(rest, step)


architecture = Architecture(PluginRegistry())
architecture.add_component("a", Shell, Hanging, Loop)
architecture.configure()
deployer = Deployer(architecture)
deployer.deploy()
time.sleep(0.1)
hangs = True
time.sleep(0.1)
deployer.shutdown()
print("the end")
sys.exit(3)
"""


@pytest.mark.parametrize("state", ["time.sleep(1.5)", "pass", "architecture.components()"])
def test_a_state_in_python_outlives_the_interpreter(state: str):
    """In a function of C, in bytecode, and in a call of the kernel without the interpreter's lock."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(state=state)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (3, "the end\n", "")
