"""Animated pictures: PNGs of equal size as one APNG, which browsers and slides play."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

__all__ = ["animated"]

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def animated(frames: Sequence[bytes], seconds: float) -> bytes:
    """The pictures, PNGs of one size and kind, shown in turn for ``seconds`` in all, for ever; by programs that cannot, the
    first.

    Source: W3C, Portable Network Graphics, third edition, 2025, sections 11.3.6 and 12.
    """
    read = [_chunks(frame) for frame in frames]
    head = read[0][b"IHDR"]
    width, height = struct.unpack(">II", head[:8])
    delay = max(1, round(1000 * seconds / len(frames)))
    out = [SIGNATURE, _chunk(b"IHDR", head), _chunk(b"acTL", struct.pack(">II", len(frames), 0))]
    number = 0
    for i, frame in enumerate(read):
        control = struct.pack(">IIIIIHHBB", number, width, height, 0, 0, delay, 1000, 0, 0)
        out.append(_chunk(b"fcTL", control))
        number += 1
        if i == 0:
            out.append(_chunk(b"IDAT", frame[b"IDAT"]))
        else:
            out.append(_chunk(b"fdAT", struct.pack(">I", number) + frame[b"IDAT"]))
            number += 1
    return b"".join([*out, _chunk(b"IEND", b"")])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _chunks(png: bytes) -> dict[bytes, bytes]:
    """The data of the chunks by kind, those of one kind joined."""
    joined: dict[bytes, bytes] = {}
    at = len(SIGNATURE)
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        kind = png[at + 4 : at + 8]
        joined[kind] = joined.get(kind, b"") + png[at + 8 : at + 8 + length]
        at += 12 + length
    return joined
