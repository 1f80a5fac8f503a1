"""The file of a shared library, as the dynamic loader reads it: names, needed libraries, symbols.

A copy may have other names. They stand in a table of strings of its own, behind the end of the old file: the
old table has no room, and its strings share their ends. Nothing else in the file moves.
"""

import os
import struct
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from mauve_rt.errors import PluginError, exception_text

MISSING = "install it by: pip install pyelftools (or apt install python3-pyelftools)"
WAIT = "wait for the end of the build, then try again"
_SYMBOL = struct.Struct("<IBBHQQ")  # Elf64_Sym: st_name, st_info, st_other, st_shndx, st_value, st_size
_UNIQUE = 10  # STB_GNU_UNIQUE
_PROGRAM_HEADER = struct.Struct("<IIQQQQQQ")  # Elf64_Phdr: type, flags, offset, addresses, sizes, alignment
_PT_LOAD, _READ = 1, 4
_SPARE = (4, 0x6474E553)  # PT_NOTE, PT_GNU_PROPERTY: no running code needs them
_PAGE_BYTES = 4096
_TAG_BYTES = 16  # Elf64_Dyn: d_tag, d_val
_SAME_AS_THIS = slice(4, 6)  # e_ident: class and byte order
_MACHINE = slice(18, 20)  # e_machine
_SUPPORTED = b"\x02\x01"  # 64 bit, little endian


class Symbol(NamedTuple):
    """One entry of the table of dynamic symbols."""

    name: bytes
    position: int  # of st_name in the file
    is_defined: bool
    is_unique: bool  # one object for the whole process


class ElfLibrary:
    """A library's file, read once and whole."""

    def __init__(self, path: Path) -> None:
        """Read and check the file.

        Raises:
            PluginError: it is no library of this machine, is not complete, or changes while it is read.
        """
        self.path = path
        self.content = _stable_content(path)
        try:
            from elftools.elf.elffile import ELFFile  # noqa: PLC0415 - of use for reloads only
        except ImportError as error:
            raise PluginError(f"reading libraries needs pyelftools ({error}); {MISSING}") from None
        _check_machine(path, self.content)
        try:
            self._elf = ELFFile(BytesIO(self.content))
            self._check_complete()
            self._sections = {section["sh_type"]: section for section in self._elf.iter_sections()}
            dynamic: Any = self._sections["SHT_DYNAMIC"]
            self._symbol_table = self._sections["SHT_DYNSYM"]
            self._string_section: int = self._symbol_table["sh_link"]
            strings = self._elf.get_section(self._string_section)
            self._strings, self._strings_size = strings["sh_offset"], strings["sh_size"]
            self._tags = [
                (tag.entry.d_tag, tag.entry.d_val, dynamic["sh_offset"] + index * _TAG_BYTES + 8)
                for index, tag in enumerate(dynamic.iter_tags())
            ]
        except PluginError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a damaged file makes the parser raise
            raise self.refused("a complete shared library", exception_text(error)) from None
        self.needed = self._names("DT_NEEDED")
        self.soname = next(iter(self._names("DT_SONAME")), b"")
        self.has_gnu_hash = any(tag == "DT_GNU_HASH" for tag, _, _ in self._tags)
        self._new_strings: dict[bytes, int] = {}

    def search_folders(self) -> list[Path]:
        """The folders of its RUNPATH or RPATH, with its own folder for $ORIGIN."""
        origin = os.fsencode(self.path.resolve().parent)
        lists = self._names("DT_RUNPATH") or self._names("DT_RPATH")
        entries = [entry for each in lists for entry in each.split(b":") if entry]
        plain = [entry.replace(b"${ORIGIN}", origin).replace(b"$ORIGIN", origin) for entry in entries]
        return [Path(os.fsdecode(entry)) for entry in plain]

    @cached_property
    def symbols(self) -> list[Symbol]:
        """The dynamic symbols, without the first, which is empty."""
        start, size = self._symbol_table["sh_offset"], self._symbol_table["sh_size"]
        table = memoryview(self.content)[start : start + size - size % _SYMBOL.size]
        try:
            return [
                Symbol(self._string(name), start + index * _SYMBOL.size, section != 0, info >> 4 == _UNIQUE)
                for index, (name, info, _, section, _, _) in enumerate(_SYMBOL.iter_unpack(table))
            ][1:]
        except ValueError as error:
            raise self.refused("a complete table of symbols", exception_text(error)) from None

    def rename(self, *, libraries: Mapping[bytes, bytes], symbols: Mapping[bytes, bytes]) -> None:
        """Give other names to itself, to libraries that it needs, to defined and undefined symbols."""
        for symbol in self.symbols:
            if symbol.name in symbols:
                self._point(symbol.position, 4, symbols[symbol.name])
        for tag, offset, position in self._tags:
            if tag in ("DT_NEEDED", "DT_SONAME") and self._string(offset) in libraries:
                self._point(position, 8, libraries[self._string(offset)])
        for position in self._version_files():
            name = self._string(self._number(position, 4))
            if name in libraries:
                self._point(position, 4, libraries[name])

    def image(self) -> bytes:
        """The whole file, with the other names."""
        if not self._new_strings:
            return bytes(self.content)
        table = self.content[self._strings : self._strings + self._strings_size]
        table += b"".join(name + b"\0" for name in self._new_strings)
        address, offset = self._add_segment(len(table))
        for tag, _, position in self._tags:
            if tag == "DT_STRTAB":
                self._put(position, 8, address)
            elif tag == "DT_STRSZ":
                self._put(position, 8, len(table))
        header = self._elf.header
        section = header["e_shoff"] + self._string_section * header["e_shentsize"]
        for place, value in ((16, address), (24, offset), (32, len(table))):  # Elf64_Shdr
            self._put(section + place, 8, value)
        return bytes(self.content).ljust(offset, b"\0") + bytes(table)

    def refused(self, expected: str, found: str, *, remedy: str = WAIT) -> PluginError:
        """The error that this file cannot be used."""
        return refused(self.path, expected, found, remedy=remedy)

    def _add_segment(self, size: int) -> tuple[int, int]:
        """Let the loader map so many bytes behind the end of the file; their address and offset."""
        header = self._elf.header
        start, count = header["e_phoff"], header["e_phnum"]
        end = start + count * _PROGRAM_HEADER.size
        entries = list(_PROGRAM_HEADER.iter_unpack(memoryview(self.content)[start:end]))
        spare = next((entry for kind in _SPARE for entry in entries if entry[0] == kind), None)
        if spare is None:
            remedy = "link it with -Wl,--build-id"
            raise self.refused("a note in its program headers", "none", remedy=remedy)
        loads = [entry for entry in entries if entry[0] == _PT_LOAD]
        alignment = max(_PAGE_BYTES, *(entry[7] for entry in loads))
        offset = _rounded_up(len(self.content), alignment)
        address = _rounded_up(max(entry[3] + entry[6] for entry in loads), alignment)
        new = (_PT_LOAD, _READ, offset, address, address, size, size, alignment)
        entries.insert(entries.index(loads[-1]) + 1, new)  # they are in the order of their addresses
        entries.remove(spare)
        self.content[start:end] = b"".join(_PROGRAM_HEADER.pack(*entry) for entry in entries)
        return address, offset

    def _point(self, position: int, size: int, name: bytes) -> None:
        """Let a field of the file name another string."""
        if name not in self._new_strings:
            before = sum(len(each) + 1 for each in self._new_strings)
            self._new_strings[name] = self._strings_size + before
        self._put(position, size, self._new_strings[name])

    def _put(self, position: int, size: int, value: int) -> None:
        self.content[position : position + size] = value.to_bytes(size, "little")

    def _number(self, position: int, size: int) -> int:
        return int.from_bytes(self.content[position : position + size], "little")

    def _version_files(self) -> Iterator[int]:
        """Where the table of needed versions names libraries (vn_file of Elf64_Verneed)."""
        section = self._sections.get("SHT_GNU_verneed")
        if section is not None:
            position = section["sh_offset"]
            for _ in range(section["sh_info"]):
                yield position + 4
                position += self._number(position + 12, 4)  # vn_next

    def _names(self, kind: str) -> list[bytes]:
        return [self._string(offset) for tag, offset, _ in self._tags if tag == kind]

    def _string(self, offset: int) -> bytes:
        start = self._strings + offset
        return bytes(self.content[start : self.content.index(0, start)])

    def _check_complete(self) -> None:
        """What the headers name lies within the file."""
        header, size = self._elf.header, len(self.content)
        end = header["e_shoff"] + header["e_shnum"] * header["e_shentsize"]
        if not header["e_shnum"] or end > size:
            raise self.refused(f"a table of sections up to byte {end}", f"{size} bytes")
        for segment in self._elf.iter_segments():
            end = segment["p_offset"] + segment["p_filesz"]
            if end > size:
                raise self.refused(f"a segment up to byte {end}", f"{size} bytes")
        for part in self._elf.iter_sections():
            end = part["sh_offset"] + (0 if part["sh_type"] == "SHT_NOBITS" else part["sh_size"])
            if end > size:
                raise self.refused(f"a section up to byte {end}", f"{size} bytes")


def refused(path: Path, expected: str, found: str, *, remedy: str = WAIT) -> PluginError:
    """The error that a library's file cannot be used."""
    return PluginError(
        f"library {path}: expected {expected}, found {found}", element=str(path), remedy=remedy
    )


def shown_name(name: bytes) -> str:
    """A name of a library or symbol, for messages."""
    return name.decode("utf-8", "backslashreplace")


def _rounded_up(value: int, to: int) -> int:
    return -(-value // to) * to


def _stable_content(path: Path) -> bytearray:
    """The file, which nothing wrote to while it was read."""

    def identity(stat: Callable[[], os.stat_result]) -> tuple[int, int, int, int]:
        found = stat()
        return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns

    try:
        with path.open("rb") as file:
            before = identity(lambda: os.fstat(file.fileno()))
            content = bytearray(file.read())
            after = identity(lambda: os.fstat(file.fileno()))
        present = identity(path.stat)
    except OSError as error:
        raise refused(path, "a file that can be read", str(error.strerror)) from None
    if not before == after == present or len(content) != before[2]:
        raise refused(path, "a file at rest", "one that is being written")
    return content


def _check_machine(path: Path, content: bytearray) -> None:
    """It is an ELF file of this machine, of which the running interpreter is one, too."""
    with Path("/proc/self/exe").open("rb") as file:
        own = file.read(_MACHINE.stop)
    if len(content) < _MACHINE.stop or content[:4] != b"\x7fELF":
        raise refused(path, "a shared library (ELF)", f"a file that begins with {bytes(content[:4])!r}")
    same = content[_SAME_AS_THIS] == own[_SAME_AS_THIS] == _SUPPORTED
    if not same or content[_MACHINE] != own[_MACHINE]:
        found = f"one of machine {int.from_bytes(content[_MACHINE], 'little')}"
        expected = f"a 64-bit library of machine {int.from_bytes(own[_MACHINE], 'little')}"
        raise refused(path, expected, found, remedy="build it for this machine")
