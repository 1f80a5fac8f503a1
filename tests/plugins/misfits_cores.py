"""A core in Python for a port whose type only C++ has."""

from mauve_rt.parts.cores import Core


class PyLarge(Core):
    """Never gets to act."""

    def act(self) -> None:
        """Nothing."""
