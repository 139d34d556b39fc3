"""NMEA 0183 (IEC 61162-1): sentences, their frames, and their meaning in SI.

Contract: bytes to a `Sentence` and back (`decode`, `encode`), strictly, with `NmeaError` for anything that is not
valid; a `Sentence` to readings in SI (`readings`); the readings of a ship's instruments to lines (`lines`, by its
`Fittings`).  `framing` has TAG blocks and the datagrams of IEC 61162-450.  Nothing here opens a socket or a file.
"""

from ...core.errors import NmeaError
from .framing import Line, Tag, datagram, read_line, split, tag_block
from .reading import readings
from .sentences import SENTENCES, Sentence, decode, encode
from .ship import Fittings, Measured, lines

__all__ = [
    "SENTENCES", "Fittings", "Line", "Measured", "NmeaError", "Sentence", "Tag", "datagram", "decode", "encode",
    "lines", "read_line", "readings", "split", "tag_block",
]  # fmt: skip
