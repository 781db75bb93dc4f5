"""RTPS messages by hand, from the tables of RTPS 2.5 (9.4 and 9.6): of participants and endpoints
that do not exist.
"""

import socket
import struct

VENDOR = bytes((1, 0x7F))  # of no vendor
PARTICIPANT = bytes.fromhex("000001c1")
# Announcers and detectors of participants and of readers.
PARTICIPANTS = bytes.fromhex("000100c7"), bytes.fromhex("000100c2")
READERS = bytes.fromhex("000004c7"), bytes.fromhex("000004c2")


def header(prefix: bytes) -> bytes:
    return b"RTPS\x02\x01" + VENDOR + prefix


def prefix(number: int) -> bytes:
    return struct.pack(">III", 0x017F0000, 0, number)


def parameter(number: int, value: bytes) -> bytes:
    value += bytes(-len(value) % 4)
    return struct.pack("<HH", number, len(value)) + value


def text(value: str) -> bytes:
    return struct.pack("<I", len(value) + 1) + value.encode() + b"\0"


def locator(port: int) -> bytes:
    return struct.pack("<iI", 1, port) + bytes(12) + socket.inet_aton("127.0.0.1")


def told(ends: tuple[bytes, bytes], *parameters: bytes) -> bytes:
    """A DATA with the first that is told, a parameter list."""
    body = struct.pack("<HH", 0, 16) + b"".join(ends) + struct.pack("<iI", 0, 1)
    body += b"\0\x03\0\0" + b"".join(parameters) + parameter(1, b"")
    return struct.pack("<BBH", 0x15, 5, len(body)) + body


def participant(prefix: bytes, port: int) -> bytes:
    """A message by which one at that port of this machine makes itself known."""
    return header(prefix) + told(
        PARTICIPANTS,
        parameter(0x15, b"\x02\x01"),
        parameter(0x16, VENDOR),
        parameter(0x50, prefix + PARTICIPANT),
        parameter(0x58, struct.pack("<I", 0xC3F)),  # its built-in endpoints
        parameter(0x31, locator(port)),
        parameter(0x32, locator(port)),
    )


def reader(prefix: bytes, topic: str, kind: str) -> bytes:
    """A message by which it says that it reads a topic, without a word on how."""
    return header(prefix) + told(
        READERS,
        parameter(0x5A, prefix + bytes.fromhex("00000104")),
        parameter(0x05, text(topic)),
        parameter(0x07, text(kind)),
    )
