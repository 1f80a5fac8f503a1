"""What shells, cores, fsms and resources written in Python have in common."""

__all__ = ["Configurable", "implementation_name"]


def implementation_name(part: type) -> str:
    """`package/Class`, as descriptions of components show it."""
    return f"{part.__module__.partition('.')[0]}/{part.__qualname__}"


class Configurable:
    """Something that is configured before use and cleaned up after, on ordinary threads."""

    def configure(self) -> bool | None:
        """Get ready. Return False or raise to refuse: it then stays unconfigured, and the reason is told."""

    def cleanup(self) -> None:
        """Let go of what configure() took."""
