"""Names of a generation: all different, those of symbols with the same hash."""

from hypothesis import given
from hypothesis import strategies as st

from mauve_rt.model.generation_names import gnu_hash, library_name, symbol_name

NAMES = st.binary(min_size=1).filter(lambda name: 0 not in name)


def test_hash_is_the_loaders() -> None:
    """From glibc's own tests of this hash."""
    assert gnu_hash(b"") == 0x00001505
    assert gnu_hash(b"printf") == 0x156B2BB8
    assert gnu_hash(b"syscall") == 0xBAC212A0


@given(NAMES, st.integers(1, 10**9))
def test_symbols_keep_their_hash(name: bytes, generation: int) -> None:
    new = symbol_name(name, generation)
    assert gnu_hash(new) == gnu_hash(name)
    assert new.startswith(b"%s@%d" % (name, generation))
    assert 0 not in new


@given(NAMES)
def test_each_generation_has_other_symbols(name: bytes) -> None:
    assert len({symbol_name(name, generation) for generation in range(1, 200)}) == 199


def test_libraries() -> None:
    assert library_name(b"libfoo.so.1", 2) == b"libfoo.so.1@2"
