"""What a file is, by its first bytes or by the form of most of its first lines, whatever its name.

A format that is not read is named with the program that turns it into one that is.
"""

from __future__ import annotations

import re
from pathlib import Path
from shlex import quote

from ..core.values import dataclass
from .n2k.layouts import frame_of
from .n2k.recorder import recorded

_LOOKED, _LINES = 1 << 16, 200
_MOST, _DAMAGE = 0.5, 1e-3
"""Share of the first lines that have the form, and of bytes of zero that a line which was cut off leaves in a text."""


@dataclass(frozen=True)
class Known:
    """A format.

    Attributes:
        name: what it is, with its article.
        format: of `seatrial import`; empty where it is not read.
        way: what turns it into a format that is read.
    """

    name: str
    format: str = ""
    way: str = ""

    def told(self, path: Path) -> str:
        """What to do with such a file, a clause for an error."""
        if self.format:
            return f"{path.name} is {self.name}: seatrial import {self.format} {quote(str(path))} -o trials"
        return f"{path.name} is {self.name}, which is not read; {self.way}"


_TSHARK = "tshark -T fields -e data.text makes text of it"
_FLASH = "give the .bin of the autopilot, or mavlogdump.py --format csv"
_UBLOX = Known("a binary log of u-blox (UBX)", way="log NMEA sentences, or export them from u-center")
_UBX, _PACKETS = b"\xb5\x62\x01", 3
"""What packets of a fix begin with, and how many make a log of them."""
_CONVERT = "NovAtel Convert makes ASCII or tables of it"
_TABLE = "export a table (CSV) and use seatrial import --guess"
_MAGIC: tuple[tuple[int, bytes, Known], ...] = (
    (0, b"\x89MCAP0\r\n", Known("an MCAP file", "mcap")),
    (0, b"#ROSBAG V2.0\n", Known("a bag of ROS 1", "rosbag1")),
    (0, b"\xa3\x95\x80", Known("a log of ArduPilot (DataFlash)", "dataflash")),
    (0, b"ULog\x01\x12\x35", Known("a ULog of PX4", "ulog")),
    (8, b"\xfd", Known("a telemetry log of MAVLink (.tlog)", "tlog")),
    (8, b"\xfe", Known("a telemetry log of MAVLink (.tlog)", "tlog")),
    (0, b"\x1b\x01\x03", Known("an Actisense EBL log", way="canboat convert makes text of it")),
    (0, b"\xd4\xc3\xb2\xa1", Known("a capture of a network (pcap)", way=_TSHARK)),
    (0, b"\xa1\xb2\xc3\xd4", Known("a capture of a network (pcap)", way=_TSHARK)),
    (0, b"\x0a\x0d\x0d\x0a", Known("a capture of a network (pcapng)", way=_TSHARK)),
    (0, b"LOGG", Known("a Vector BLF log", way="can_logconvert of python-can makes a .log of candump")),
    (0, b"TDSm", Known("a LabVIEW TDMS file", way=f"nptdms reads it: {_TABLE}")),
    (0, b"\xaa\x44\x12", Known("a binary log of NovAtel", way=_CONVERT)),
    (0, b"\xaa\x44\x13", Known("a binary log of NovAtel", way=_CONVERT)),
    (0, b"$@", Known("a binary log of Septentrio (SBF)", way="bin2asc or sbf2asc makes tables of it")),
    (0, b"\xb5\x62", _UBLOX),
    (0, b"\xfa\xff", Known("a binary log of Xsens", way=f"MT Manager: {_TABLE}")),
    (0, b"\xff\x5a", Known("a binary log of SBG (sbgECom)", way=f"sbgBasicLogger or sbgCenter: {_TABLE}")),
    (0, b"CDF\x01", Known("a netCDF file", way=f"xarray reads it: {_TABLE}")),
    (0, b"CDF\x02", Known("a netCDF file", way=f"xarray reads it: {_TABLE}")),
    (0, b"\x89HDF\r\n\x1a\n", Known("an HDF5 file", way=f"h5py or xarray reads it: {_TABLE}")),
    (0, b"# Created by Octave", Known("a text file of Octave", way="in Octave: save('-v7', 'NAME.mat')")),
    (0, b"SQLite format 3\0", Known("a database of SQLite", way=_TABLE)),
    (0, b"\x1f\x8b", Known("packed by gzip", way="gunzip it")),
    (0, b"\x28\xb5\x2f\xfd", Known("packed by zstd", way="unzstd it")),
    (0, b"BZh", Known("packed by bzip2", way="bunzip2 it")),
    (0, b"7z\xbc\xaf\x27\x1c", Known("packed by 7-Zip", way="unpack it")),
)  # fmt: skip
_RECORDER = Known("a log of a voyage recorder of Yacht Devices (.DAT)", "n2k")
_LOGGED = re.compile(r"\d{13};(A;|I;\{)")
"""A line of a server of Signal K that is a frame or a delta, and no sentence."""
_JSON = Known("JSON", way="make a table of it: python -c \"import polars; polars.read_ndjson('FILE')"
                          ".write_csv('FILE.csv')\" (read_json where one list is all of it)")  # fmt: skip
_FORMS: tuple[tuple[re.Pattern[str], Known], ...] = (
    (re.compile(r"%%%%|%% LOG|[\d.]+\s+[A-Z][A-Z0-9_]+\s+[A-Za-z]\w+\s"), Known("a log of MOOS", "moos")),
    (re.compile(r'\{.*"updates"'), Known("a log of Signal K", "signalk")),
    (re.compile(r'\{.*"pgn":\s*\d{5,6},.*"fields":'), Known("a log of NMEA 2000 as JSON", "n2k")),
    (re.compile(r'\{"class":"(TPV|SKY|GST|ATT|VERSION|DEVICES?|WATCH|AIS)"'),
     Known("a log of gpsd as JSON", way="gpspipe -r writes the sentences of its receivers, and those are read")),
    (re.compile(r"FMT, \d+, \d+, |[A-Z][A-Z0-9]{2,3}, \d{4,}, "), Known("a text log of ArduPilot", "dataflash")),
    (re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d+: [A-Z0-9]+ \{"),
     Known("a print of mavlogdump", way=_FLASH)),
    (re.compile(r"#[A-Z0-9]+A,.*;|%[A-Z0-9]+SA,.*;"),
     Known("an ASCII log of NovAtel", "novatel")),
    (re.compile(r"!?[Bb]oat,|0,\d{5}\.\d+,\d+,|!v\d+\."), Known("a log of Expedition", way=f"Expedition: {_TABLE}")),
    (re.compile(r"(FTP|VER|TND|DEV|POS|GYR|HCP|MSG|RAW|EC1|QUA|ATT) "), Known("a RAW file of HYPACK",
     way="export its GYR, POS and HCP records as a table")),
    (re.compile(r'"?TOA5"?,|"?TOB1"?,'), Known("a log of a Campbell logger", way="leave out its header but the names: "
                                              "seatrial import csv with skip in the mapping")),
    (re.compile(r"[A-Z]{2}(GGA|RMC|GLL|VTG|ZDA|GNS|HDT|HDG|ROT|RSA|VHW|MWV),.*\*[0-9A-F]{2}\s*$"),
     Known("a log of NMEA 0183 without the $ of its sentences", way="put it back: sed 's/^/$/' FILE > FILE.nmea")),
    (re.compile(r"[A-Za-z_][\w.-]*(,[\w.-]+=[^ ,=]+)* [\w.-]+=[^ ,=]+(,[\w.-]+=[^ ,=]+)*( \d{10,19})?$"),
     Known("the line protocol of InfluxDB", way="influx query writes annotated CSV, which is read: "
                                                "seatrial import --guess")),
    (re.compile(r"[A-Za-z_][\w.-]*=[^ =]+( [A-Za-z_][\w.-]*=[^ =]+){2,}\s*$"),
     Known("lines of names and values (logfmt)", way="make a table of it: mlr --ifs space --ocsv unsparsify FILE")),
    (re.compile(r'\s*[\[{].*"\w+"\s*:'), _JSON),
    (re.compile(r"\s*<(\?xml|gpx|trk|trkpt|trkseg|ele|time)\b.*"), Known("a GPX track", "gpx")),
)  # fmt: skip


_MARKED = (
    ("<kml", Known("a KML file", way="gpsbabel -i kml -o gpx makes a GPX track of it")),
    ("<trainingcenterdatabase", Known("a track of TCX", way="gpsbabel -i gtrnctr -o gpx makes a GPX track of it")),
    ("<html", Known("a page of HTML", way="open it in a spreadsheet program and save it as .xlsx or CSV")),
    ("<table", Known("a page of HTML", way="open it in a spreadsheet program and save it as .xlsx or CSV")),
    ("<workbook", Known("a spreadsheet in XML of 2003", way="open it in a spreadsheet program and save it as .xlsx")),
)
_SENTENCE = re.compile(rb"[$!][A-Z0-9]{4,15},")
"""The address that a sentence of NMEA 0183 begins with, behind a stamp or not."""


def sentences(path: Path) -> bool:
    """Whether most of the first lines are sentences of NMEA 0183."""
    with path.open("rb") as file:
        lines = [line for line in file.read(4000).splitlines()[:-1] if line.strip()]
    marked = sum(_SENTENCE.search(line[:80]) is not None for line in lines)
    return len(lines) > 1 and marked > 0.5 * len(lines)


def recognise(path: Path) -> Known | None:
    """What a file is; None for a table, a trial file, or one that nothing tells."""
    try:
        with path.open("rb") as file:
            head = file.read(_LOOKED)
    except OSError:
        return None
    known = next((one for at, magic, one in _MAGIC if head.startswith(magic, at)), None)
    if head.startswith(b"SQLite") and all(f"CREATE TABLE {name}".encode() in head for name in ("topics", "messages")):
        return Known("a database of a bag of ROS 2", "rosbag2")
    if known is not None and not (known.name.startswith("a telemetry") and not _since_1970(head)):
        return known
    if b"\0" in head:
        # packets of a receiver may stand behind remarks, or among sentences
        found = _UBLOX if head.count(_UBX) > _PACKETS else _RECORDER if recorded(head) else None
        if found or head.count(b"\0") > _DAMAGE * len(head):
            return found
    return _by_lines(head.decode("utf-8-sig", "replace"))


def _since_1970(head: bytes) -> bool:
    """Whether the first 8 bytes are microseconds of the years 2000 to 2100."""
    return 946684800 * 10**6 < int.from_bytes(head[:8], "big") < 4102444800 * 10**6


def _by_lines(text: str) -> Known | None:
    lines = [line for line in text.splitlines()[: 4 * _LINES] if line.strip()]
    spoken = [line for line in lines if line[0] not in "#;"][:_LINES] or lines[:_LINES]
    if not spoken:
        return None
    if "<gpx" in text[:2000]:
        return _FORMS[-1][1]
    if text.lstrip()[:1] == "[" and re.match(r"\[\s*\{\s*\"", text.lstrip()):
        return _JSON
    if marked := next((known for mark, known in _MARKED if mark in text[:2000].lower()), None):
        return marked
    if sum(_LOGGED.match(line) is not None for line in spoken) > _MOST * len(spoken):
        return Known("a log of Signal K", "signalk")
    if sum(frame_of(line.rstrip()) is not None for line in spoken) > _MOST * len(spoken):
        return Known("a log of NMEA 2000", "n2k")
    for form, known in _FORMS[:-1]:
        # definitions come first: a line of its own form is as good as half of the others
        some = lines[:_LINES] if known.name.startswith("an ASCII") else spoken
        if sum(form.match(line) is not None for line in some) > _MOST * len(some):
            return known
    return None
