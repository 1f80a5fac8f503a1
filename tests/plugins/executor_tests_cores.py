"""A core in Python for the executor's tests."""

from std_msgs.msg import Float64

from mauve_rt.cores import Core


class PyCounter(Core):
    """Counts in hundreds."""

    def configure(self) -> None:
        """Start from nothing."""
        self.count = 0.0

    def act(self) -> None:
        """Count once."""
        sample = self.shell.set.read()
        if sample.is_new:
            self.count = sample.value.data
        self.count += 100.0 * self.shell.step.value
        self.shell.count.write(Float64(data=self.count))
