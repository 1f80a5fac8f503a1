"""Names of one generation: other ones for each generation, and, of symbols, with the same hash.

Copies of rebuilt libraries carry these names, so that they bind to each other and not to the old libraries.
"""

_HASH = 33  # the GNU hash of a name is h = 33 * h + c over its characters, from 5381 on
_BITS = 0xFFFFFFFF
_DIGITS = 7  # of base 33: they have every value of 32 bits
_LEAST = ord("A")  # the digits are A to a


def library_name(name: bytes, generation: int) -> bytes:
    """`libfoo.so@2` of `libfoo.so`."""
    return b"%s@%d" % (name, generation)


def symbol_name(name: bytes, generation: int) -> bytes:
    """`NAME@2...`, with as many more characters as give it the hash of NAME.

    With the same hash the library's hash table stays as it is.
    """
    plain = b"%s@%d" % (name, generation)
    rest = (gnu_hash(name) - gnu_hash(plain + bytes([_LEAST]) * _DIGITS)) & _BITS
    digits = bytearray()
    for _ in range(_DIGITS):
        rest, digit = divmod(rest, _HASH)
        digits.insert(0, _LEAST + digit)
    return plain + bytes(digits)


def gnu_hash(name: bytes) -> int:
    """By which the loader looks a symbol up (DT_GNU_HASH)."""
    value = 5381
    for character in name:
        value = (value * _HASH + character) & _BITS
    return value
