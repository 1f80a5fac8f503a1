"""The one error class of the trace package."""


class TraceError(Exception):
    """Recording or reading a trace failed. str() is one line: what, where, expected, found, remedy."""
