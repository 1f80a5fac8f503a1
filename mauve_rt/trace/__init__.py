"""Execution traces: recording them as rosbags, reading them back, statistics.

Recording (`recorder`, `bag`, `mcap_file`, `cdr`, `definitions`) needs neither rosbags nor numpy, so that
the executor stays small. Reading (`reader`, `statistics`, `reconfigurations`) needs both, and no installed
message package: a bag carries the definitions of what it holds.
"""

from mauve_rt.trace.errors import TraceError

__all__ = ["TraceError"]
