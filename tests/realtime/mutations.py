"""Datagrams of orders, damaged in every way a wire or a fool may damage them; the same for the same seed."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from functools import cache

from seatrial.data.nmea.framing import TOKEN, Tag, tag_block
from seatrial.data.nmea.sentences import SENTENCES, Sentence, checksum, encode

_FIELDS = {
    "ROR": {"stbdrudderorder": 10.0, "stbdrudderstatus": "A", "portrudderstatus": "V", "operatinglocind": "B"},
    "HTC": {"override": "V", "steermode": "H", "turnmode": "N", "cmdheading": 20.0, "headingref": "T", "status": "C"},
    "TRC": {"thrusternum": 1, "dmdrpm": 50.0, "rpmmode": "P", "operatinglocind": "B", "status": "C"},
    "PRC": {"rpmdemand": 60.0, "rpmdemandstatus": "R", "engineshaftnum": 0},
    "ETL": {"time": 0.0, "msgtype": "O", "engtelposind": "03", "operatinglocind": "B"},
    "APB": {"LCgwarn": "A", "LCcwarn": "A", "ctrkerr": 0.02, "dirs": "L", "ctrkUnit": "N", "bearO2D": 5.0,
            "bearO2Du": "T"},
    "XTE": {"gwarn": "A", "LCcwarn": "A", "ctrkerr": 0.01, "dirs": "R", "disUnit": "N"},
    "HDT": {"headingT": 1.0, "headingTu": "T"},
    "ACN": {"time": 0.0, "alertid": 10001, "alertnum": 1, "alertcmd": "A", "status": "C"},
    "ACK": {"alarmid": 101},
}  # fmt: skip


@cache
def whole() -> list[bytes]:
    """Valid orders, and a sentence that is none."""
    return [encode(Sentence("AG", kind, {**dict.fromkeys(SENTENCES[kind].fields), **fields}))
            for kind, fields in _FIELDS.items()]  # fmt: skip


def summed(body: bytes) -> bytes:
    """A sentence with the right checksum, whatever is in it."""
    return b"$" + body + b"*" + checksum(body).encode() + b"\r\n"


def datagrams(number: int, seed: int) -> Iterator[bytes]:
    """So many datagrams; about one in ten is whole."""
    rng, good = random.Random(seed), whole()
    last = good[0]
    for _ in range(number):
        # now and then the last one comes again
        last = last if rng.random() < 0.1 else rng.choice(_DAMAGE)(rng, rng.choice(good))
        yield last


def _parts(base: bytes) -> list[bytes]:
    return base[1 : base.index(b"*")].split(b",")


def _bits(rng: random.Random, base: bytes) -> bytes:
    data = bytearray(base)
    for _ in range(rng.randint(1, 4)):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def _other_fields(rng: random.Random, base: bytes) -> bytes:
    """Fields exchanged for others, with the right checksum."""
    parts = _parts(base)
    for _ in range(rng.randint(1, 3)):
        parts[rng.randrange(len(parts))] = rng.choice(_CELLS)
    return summed(b",".join(parts))


def _number_of_fields(rng: random.Random, base: bytes) -> bytes:
    parts = _parts(base)
    more = rng.random() < 0.5
    return summed(b",".join(parts + [b"1"] * rng.randint(1, 40) if more else parts[: rng.randint(1, len(parts))]))


def _framed(rng: random.Random, base: bytes) -> bytes:
    """With a TAG block that may be damaged."""
    tag = bytearray(tag_block(Tag("AG0001", rng.randrange(1000), 1.8e9 + rng.randrange(100))))
    if rng.random() < 0.5:
        tag[rng.randrange(len(tag))] = rng.randrange(256)
    return TOKEN[: rng.choice([6, 6, 6, 3])] + bytes(tag) + base


def _run_together(rng: random.Random, base: bytes) -> bytes:
    other = rng.choice(whole())
    return base[: rng.randrange(len(base))] + other[rng.randrange(len(other)) :]


def _rubble(rng: random.Random, base: bytes) -> bytes:
    rubble = [base, b"\r\n", b"\x00" * 20, b"\\", b"$", b"*00", b"!AIVDM,1,1*00\r\n"]
    return b"".join(rng.sample(rubble, 5))


def _carriage_returns(rng: random.Random, base: bytes) -> bytes:
    """Line ends that are none: a CR alone, between sentences or as often as there is room."""
    bare = [base.replace(b"\r\n", b"\r") * 3, base[:-1] + b"x\r" * rng.randint(1, 700), b"x\r" * 736, b"\r" + base]
    return rng.choice(bare)


_CELLS = [b"", b"nan", b"inf", b"-1e9", b"99999999999", b"A", b"-0", b"1.5.2", b"\xff", b"AGROR", b"0x1", b" 1", b"180"]

_DAMAGE: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    lambda rng, base: base, _bits, lambda rng, base: base[: rng.randrange(len(base))], _other_fields,
    _number_of_fields, lambda rng, base: rng.randbytes(rng.randrange(200)), _run_together, _framed,
    lambda rng, base: base * rng.randint(18, 40), _rubble,
    _carriage_returns,
)  # fmt: skip
