"""NMEA 0183 (IEC 61162-1): sentences, their frames, and their meaning in SI.

Contract: `sentences` has bytes to a `Sentence` and back (`decode`, `encode`), strictly, with `NmeaError` for anything
that is not valid; `readings` a `Sentence` to readings in SI; `ship` the readings of a ship's instruments to lines, by
its `Fittings`.  `framing` has TAG blocks and the datagrams of IEC 61162-450.  Nothing here opens a socket or a file.
"""
