"""Compresses the chunks of MCAP files."""

from collections.abc import Callable

from mauve_rt.trace.bag.recorded import COMPRESSIONS
from mauve_rt.trace.errors import TraceError

_LEVEL = 1  # by far the fastest, and a trace becomes hardly smaller by a higher one
MAX_CHUNK_BYTES = 256 << 20
"""Of a compressed chunk, unpacked."""
BYTES_PER_BYTE = 200
"""So many bytes the chunks of a file may hold for each of its bytes: a reader refuses more as an attack."""

Compress = Callable[[bytearray], bytes]


def compressor(name: str) -> Compress | None:
    """Return what compresses by that name; None: by `none`.

    Raises:
        TraceError: there is no such compression, or its Python package is not installed.

    """
    if name not in COMPRESSIONS:
        msg = f"compression '{name}': expected {' or '.join(COMPRESSIONS)}"
        raise TraceError(msg)
    if name == "none":
        return None
    try:
        from zstandard import ZstdCompressor  # noqa: PLC0415 - only who compresses needs it
    except ImportError as error:
        msg = f"compression zstd: needs more ({error}); install it by: pip install zstandard"
        raise TraceError(msg) from error
    return ZstdCompressor(level=_LEVEL).compress


def compressed(records: bytearray, compress: Compress | None) -> tuple[str, bytes | bytearray]:
    """Return the name of the compression of a chunk, and its data; an empty name: as it was.

    Data that become no smaller stay as they are, and those of which a reader believes no unpacked size.
    """
    if compress is None:
        return "", records
    data = compress(records)
    is_readable = len(records) <= min(MAX_CHUNK_BYTES, BYTES_PER_BYTE * len(data))
    return ("zstd", data) if is_readable and len(data) < len(records) else ("", records)
