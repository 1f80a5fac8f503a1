"""The one error class of the trace package."""


class TraceError(Exception):
    """Recording or reading a trace failed. str() is one line: what, where, expected, found, remedy."""


class DiskError(TraceError):
    """A disk refused to write: it is full, a file may not grow, or the disk failed. The bag is as before."""


def libraries_missing(error: ImportError) -> TraceError:
    """Return the error that says how to get the libraries by which bags are read; recording needs none."""
    return TraceError(f"reading bags needs more ({error}); install it by: pip install mcap rosbags")
