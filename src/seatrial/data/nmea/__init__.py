"""NMEA 0183 (IEC 61162-1): sentences, their frames, and their meaning in SI.

Contract: `sentences` has bytes to a `Sentence` and back (`decode`, `encode`), strictly, with `NmeaError` for anything
that is not valid; `heard` those of devices, loosely; `readings` their meaning in SI; `ship` the readings of a ship's
instruments to lines, by its `Fittings`.  `framing` has TAG blocks and the datagrams of IEC 61162-450.  `lines` reads
logs, many sentences at a time (`columns`, `digits`).  Nothing here opens a socket.
"""
