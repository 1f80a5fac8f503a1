"""A metronome's core in Python, to replace the one in C++ while it runs."""

from std_msgs.msg import Float64

from mauve_rt.api import Core


class Metronome(Core):
    """Does what the core in C++ does: one method for each action and guard of the FSM."""

    def configure(self) -> None:
        """Start to count anew."""
        self.ticks = 0  # since the last beat
        self.beats = 0

    def adopt(self, old: object) -> None:
        """Go on counting where another core in Python was; of one in C++ nothing is to be seen (None)."""
        if isinstance(old, Metronome):
            self.ticks, self.beats = old.ticks, old.beats

    def tick(self) -> None:
        """Count."""
        self.ticks += 1

    def is_beat_due(self) -> bool:
        """Whether it is time."""
        return bool(self.ticks >= self.shell.ticks_per_beat.value)

    def beat(self) -> None:
        """Write the number of the beat."""
        self.ticks = 0
        self.beats += 1
        self.shell.beat.write(Float64(data=float(self.beats)))
