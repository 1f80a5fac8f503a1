"""Commands to type after a demo, or beside it: in a shell that knows nothing of this installation."""

import shlex

from mauve_rt.parts.ament_index import share_folder


def sourcing() -> list[str]:
    """The command that makes `mauve` known; none where it is known anyway, as after `pip install`."""
    share = share_folder("mauve_examples")
    setup = share.parents[1] / "setup.bash" if share else None
    return [f"source {shlex.quote(str(setup))}"] if setup and setup.is_file() else []
