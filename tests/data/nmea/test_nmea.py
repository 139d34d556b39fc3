"""Units and signs sentence by sentence; what is unknown or missing is an error; null stays null."""

from __future__ import annotations

import math

import pytest
from exact_instruments import told_by_exact

from seatrial.core.constants import KNOT
from seatrial.data import DataError
from seatrial.data.geodesy import Datum
from seatrial.data.nmea.framing import LARGEST, TOKEN, Line, Tag, datagram, read_line, split, tag_block
from seatrial.data.nmea.heard import hear
from seatrial.data.nmea.readings import readings
from seatrial.data.nmea.sentences import SENTENCES, Clock, NmeaError, Number, Place, Sentence, checksum, decode, encode
from seatrial.data.nmea.ship import SPOKEN, Fittings
from seatrial.data.nmea.ship import lines as spoken

NOW = {
    "t": 60.0, "x": 100.0, "y": -50.0, "psi": math.radians(350.0), "u": 5.0, "v_m": -0.5, "r": math.radians(-0.5),
    "delta": math.radians(-12.0), "n_P": 1.5, "wind_x": 8.0, "wind_y": 0.0, "current_x": 0.0, "current_y": 1.0,
    "per_depth": 1 / 40.0,
}  # fmt: skip
FIT = Fittings(Datum(35.0, 139.0), antenna=(20.0, -3.0), log=10.0, stern=-70.0, transducer=8.0)


def built(kind: str, **fields):
    """A sentence with these fields, the others null."""
    return Sentence("II", kind, {**dict.fromkeys(SENTENCES[kind].fields), **fields})


def lines(kind: str, fit: Fittings, now: dict[str, float]) -> list[bytes]:
    return spoken(kind, fit, told_by_exact(fit, now))


def line(text: str) -> bytes:
    return f"${text}*{checksum(text.encode())}\r\n".encode()


def told(kind: str) -> list[dict[str, float]]:
    return [readings(hear(one)) for one in lines(kind, FIT, NOW)]


def test_heading_is_in_degrees_from_north():
    assert lines("HDT", FIT, NOW) == [b"$HEHDT,350.00,T*19\r\n"]
    assert readings(hear(b"$RCHDT,335.2,T*34")) == {"psi": pytest.approx(math.radians(335.2))}  # of a manual
    assert lines("THS", FIT, NOW)[0].startswith(b"$HETHS,350.00,A*")
    for kind in ("HDT", "THS"):
        assert told(kind) == [{"psi": pytest.approx(math.radians(350.0))}]


@pytest.mark.parametrize(
    ("psi", "text"), [(-1e-9, b"0.00"), (2 * math.pi, b"0.00"), (-0.1, b"354.27"), (7.0, b"41.07")]
)
def test_heading_wraps(psi, text):
    assert lines("HDT", FIT, {**NOW, "psi": psi})[0].split(b",")[1] == text


def test_rate_of_turn_is_in_degrees_per_minute_and_negative_to_port():
    assert lines("ROT", FIT, NOW)[0].startswith(b"$TIROT,-30.00,A*")
    assert told("ROT")[0]["r"] == pytest.approx(math.radians(-0.5))


def test_dual_speed_is_in_knots_at_the_log_and_negative_to_port_and_astern():
    said = told("VBW")[0]
    assert said["u_log"] == pytest.approx(5.0, abs=3e-4)
    assert said["v_log"] == pytest.approx(-0.5 + 10.0 * NOW["r"], abs=3e-4)
    assert said["v_stern"] == pytest.approx(-0.5 - 70.0 * NOW["r"], abs=3e-4)
    # the water goes east; on heading 350 it comes from port, and a little from ahead
    assert said["u_log_water"] == pytest.approx(5.0 + math.sin(math.radians(10.0)), abs=3e-4)
    assert said["v_log_water"] == pytest.approx(said["v_log"] - math.cos(math.radians(10.0)), abs=6e-4)
    sent = decode(lines("VBW", FIT, {**NOW, "u": -1.0})[0])
    assert sent["longgroundspd"] == pytest.approx(-1.0 / KNOT, abs=5e-4)
    assert sent["transgroundspd"] < 0


def test_position_course_and_speed_are_those_of_the_antenna():
    psi, r = NOW["psi"], NOW["r"]
    north = 100.0 + 20.0 * math.cos(psi) + 3.0 * math.sin(psi)
    east = -50.0 + 20.0 * math.sin(psi) - 3.0 * math.cos(psi)
    u, v = 5.0 + 3.0 * r, -0.5 + 20.0 * r
    for kind in ("RMC", "GGA"):
        said = told(kind)[0]
        x, y = FIT.datum.north_east(said["latitude"], said["longitude"])
        assert (x, y) == (pytest.approx(north, abs=2e-3), pytest.approx(east, abs=2e-3))
    for kind in ("RMC", "VTG"):
        said = told(kind)[0]
        assert said["U_G"] == pytest.approx(math.hypot(u, v), abs=3e-4)
        assert math.remainder(said["gamma_G"] - psi - math.atan2(v, u), 2 * math.pi) == pytest.approx(0.0, abs=1e-4)
    assert decode(lines("VTG", FIT, NOW)[0])["sogk"] == pytest.approx(3.6 * math.hypot(u, v), abs=1e-3)


def test_time_and_date_are_utc():
    late = Fittings(epoch=1_798_761_599.99)  # the last hundredth of 2026
    assert b",235959.99,31,12,2026," in lines("ZDA", late, {**NOW, "t": 0.0})[0]
    assert b",000000.00,01,01,2027," in lines("ZDA", late, {**NOW, "t": 0.006})[0]
    assert b",311226," in lines("RMC", late, {**NOW, "t": 0.0})[0]


@pytest.mark.parametrize(("simulator", "mode", "status", "quality"), [(False, "A", "A", 1), (True, "S", "V", 8)])
def test_a_receiver_of_a_simulator_is_void_wherever_it_says_that_it_is_one(simulator, mode, status, quality):
    fit = Fittings(simulator=simulator)
    fix, course, speed, heading = (decode(lines(kind, fit, NOW)[0]) for kind in ("GGA", "RMC", "VTG", "THS"))
    assert (course["posMode"], course["status"]) == (mode, status)
    assert speed["posMode"] == heading["mi"] == mode
    assert fix["quality"] == quality


def test_engine_and_shaft_do_not_mix():
    by_shaft, by_engine = readings(hear(line("RCRPM,S,0,100.0,,A"))), readings(hear(line("RCRPM,E,0,500.0,,A")))
    assert by_shaft == {"rpm_S_0": 100.0}
    assert by_engine == {"rpm_E_0": 500.0}


def test_rudder_is_positive_to_starboard_and_a_single_one_stands_in_the_first_field():
    assert lines("RSA", FIT, NOW)[0].startswith(b"$RCRSA,-12.00,A,,V*")
    assert told("RSA") == [{"delta": pytest.approx(math.radians(-12.0))}]
    twin = Fittings(rudders=("delta_1", "delta_2"))
    sent = decode(lines("RSA", twin, {**NOW, "delta_1": 0.1, "delta_2": -0.2})[0])
    assert sent["stbdangle"] == pytest.approx(math.degrees(-0.2), abs=0.01)
    assert sent["portangle"] == pytest.approx(math.degrees(0.1), abs=0.01)


def test_revolutions_per_minute_are_positive_ahead_odd_to_starboard_even_to_port():
    assert lines("RPM", FIT, {**NOW, "n_P": -1.5})[0].startswith(b"$RCRPM,S,0,-90.00,,A*")
    assert told("RPM") == [{"rpm_S_0": pytest.approx(90.0)}]
    three = Fittings(shafts=("n_1", "n_2", "n_3"))
    assert three.numbers == {"n_1": 2, "n_2": 0, "n_3": 1}
    assert Fittings(shafts=("n_1", "n_2")).numbers == {"n_1": 2, "n_2": 1}


def test_wind_relative_is_the_apparent_one_and_theoretical_the_true_one_from_the_bow():
    relative, true = told("MWV")
    assert true["U_T"] == pytest.approx(8.0)
    assert true["gamma_T_bow"] == pytest.approx(math.radians(10.0))  # from north, heading 350
    ahead, aside = 8.0 * math.cos(math.radians(10.0)) + 5.0, 8.0 * math.sin(math.radians(10.0)) - 0.5
    assert relative["U_A"] == pytest.approx(math.hypot(ahead, aside), abs=1e-3)
    assert relative["gamma_A"] == pytest.approx(math.atan2(aside, ahead), abs=1e-4)
    knots = line("WIMWV,270.0,R,10.0,N,A")
    assert readings(hear(knots))["U_A"] == pytest.approx(10.0 * KNOT)
    assert readings(hear(line("WIMWV,270.0,R,36.0,K,A")))["U_A"] == pytest.approx(10.0)


def test_depth_is_below_the_transducer_and_null_in_deep_water():
    assert lines("DPT", FIT, NOW)[0].startswith(b"$SDDPT,32.000,8.00,*")
    assert told("DPT") == [{"depth": pytest.approx(40.0)}]
    assert lines("DPT", FIT, {**NOW, "per_depth": 0.0})[0].startswith(b"$SDDPT,,8.00,*")


def test_transponder_sentence():
    pyais = pytest.importorskip("pyais")
    [one] = lines("VDO", FIT, NOW)
    said = pyais.decode(one.strip()).asdict()
    assert one.startswith(b"!AIVDO,1,1,,")
    assert said["heading"] == 350
    assert said["turn"] < 0
    assert said["lat"] == pytest.approx(35.0, abs=0.01)


@pytest.mark.parametrize("kind", SPOKEN)
def test_what_is_sent_reads_back_and_pynmeagps_reads_the_same(kind):
    library = pytest.importorskip("pynmeagps")
    for one in lines(kind, FIT, NOW):
        sent = decode(one)
        theirs = library.NMEAReader.parse(one)
        assert encode(sent) == one
        for name, value in sent.fields.items():
            if isinstance(value, float | int) and not isinstance(SENTENCES[kind].fields[name], Clock):
                assert getattr(theirs, name) == pytest.approx(value, abs=1e-9), name
            if value is None:
                assert getattr(theirs, name) == ""


@pytest.mark.parametrize("kind", SENTENCES)
def test_null_stays_null(kind):
    bare = encode(built(kind))
    empty = decode(bare)
    assert set(empty.fields) == set(SENTENCES[kind].fields)
    assert all(value is None for value in empty.fields.values())
    assert readings(hear(bare)) == {} or kind in ("RPM",)


@pytest.mark.parametrize("kind", SENTENCES)
def test_fields_are_those_of_pynmeagps(kind):
    types = pytest.importorskip("pynmeagps.nmeatypes_get")
    theirs = [name for name in types.NMEA_PAYLOADS_GET[kind] if name not in ("NS", "EW", "targetlatNS", "targetlonEW")]
    assert list(SENTENCES[kind].fields) == theirs


def test_what_is_not_said_right_is_an_error():
    good = {"headingT": 10.0, "headingTu": "T"}
    for fields, message in [
        ({"heading": 10.0, "headingTu": "T"}, "HDT: no field 'heading'; near: headingT"),
        ({"headingT": 10.0}, "HDT: field 'headingTu' is missing; None makes it null"),
        ({**good, "headingT": math.nan}, "field 'headingT' cannot be nan"),
        ({**good, "headingT": 400.0}, "field 'headingT' cannot be 400"),
        ({**good, "headingT": "10"}, "field 'headingT' cannot be '10'"),
        ({**good, "headingTu": "T,1"}, "field 'headingTu' cannot be"),
    ]:
        with pytest.raises(NmeaError, match=message):
            encode(Sentence("HE", "HDT", fields))
    with pytest.raises(NmeaError, match="no sentence 'HDX'; near: HDT"):
        encode(Sentence("HE", "HDX", good))
    with pytest.raises(NmeaError, match="two capital letters"):
        encode(Sentence("he", "HDT", good))
    with pytest.raises(NmeaError, match="82 at most"):
        encode(built("HTC", override="A", cmdrudderang=180.0, cmdrudderdir="L", steermode="M", turnmode="R",
                     cmdrudderlimit=180.0, cmdoffheadinglimit=180.0, cmdturnradius=99999.0, cmdturnrate=9999.0,
                     cmdheading=359.0, cmdofftracklimit=99999.0, cmdtrack=359.0, headingref="T"))  # fmt: skip


@pytest.mark.parametrize(
    ("raw", "reason"),
    [
        (b"$HEHDT,10.0,T*00\r\n", "checksum"), (b"$HEHDT,10.0,T\r\n", "form"), (b"HEHDT,10.0,T*1F\r\n", "form"),
        (line("HEHDT,1e2,T"), "field"), (line("HEHDT,nan,T"), "field"), (line("HEHDT,+10,T"), "field"),
        (line("HEHDT,0x10,T"), "field"), (line("HEHDT,1_0,T"), "field"), (line("HEHDT,10.0"), "field"),
        (line("HEHDT,10.0,T,A"), "field"), (line("HEHDT,10.0,M"), "field"), (line("HEHDT,360.1,T"), "field"),
        (line("HEHDT, 10.0,T"), "field"), (line("HEXXX,1"), "kind"), (line("PGRME,1"), "kind"),
        (line("GPRMC,250000,A,,,,,,,,,,,"), "field"), (line("GPRMC,120000,A,3560.0,N,,,,,,,,,"), "field"),
        (line("GPRMC,120000,A,3530.0,X,,,,,,,,,"), "field"), (line("GPRMC,120000,A,,,,,,,310299,,,,"), "field"),
        (line("HEHDT," + "1" * 90 + ",T"), "length"), (b"", "form"), (b"\xff\xfe$", "form"), (b"$*00", "form"),
        (line("HEHDT,\xb2.0,T").replace(b"\xc2", b""), "form"), (b"!AIVDO,1,1,,A,x,0*00", "checksum"),
    ],
)  # fmt: skip
def test_what_is_not_valid_is_refused_with_its_reason(raw, reason):
    with pytest.raises(NmeaError) as error:
        decode(raw)
    assert error.value.reason == reason
    assert "\n" not in str(error.value)


def test_older_sentences_lack_their_last_fields():
    assert decode(line("GPVTG,10.0,T,,M,5.0,N,9.26,K"))["posMode"] is None
    assert decode(line("VDVBW,1.0,0.0,A,1.0,0.0,A"))["sterntransgroundspd"] is None
    with pytest.raises(NmeaError, match="'sognUnit' is missing"):
        decode(line("GPVTG,10.0,T,,M,5.0"))


def test_minutes_never_become_sixty():
    assert Place(90, ("N", "S")).text(34.9999999999) == "3500.0000000,N"
    assert Place(180, ("E", "W")).text(-179.99999999999) == "18000.0000000,W"


def test_tag_block_and_datagram():
    sentence = encode(Sentence("HE", "HDT", {"headingT": 98.25, "headingTu": "T"}))
    data = datagram([Line(sentence, Tag("HE0001", n, 1793275200.125)) for n in (998, 999, 0)])
    assert data.startswith(TOKEN + b"\\s:HE0001,n:998,c:1793275200125*")
    found = [read_line(one) for one in split(data)]
    assert [one.tag.number for one in found] == [998, 999, 0]
    assert {one.sentence for one in found} == {sentence.strip()}
    assert found[0].tag.time == 1793275200.125
    assert read_line(b"\\c:1793275200*57\\x").tag.time == 1793275200.0
    assert read_line(tag_block(Tag(number=7)) + b"x").tag == Tag(None, 7, None)


@pytest.mark.parametrize(
    "raw", [b"\\s:HE0001*00\\", b"\\s:HE0001", b"\\z:1*4B\\", b"\\n:1000*", b"\\\\$", b"\\n:x*2C\\"]
)
def test_bad_tag_blocks(raw):
    if raw == b"\\n:1000*":
        raw += checksum(b"n:1000").encode() + b"\\"
    with pytest.raises(NmeaError):
        read_line(raw)


def test_datagrams_fit_a_frame():
    with pytest.raises(NmeaError, match="1472 is the most"):
        split(b"x" * (LARGEST + 1))
    with pytest.raises(NmeaError, match="1472 is the most"):
        datagram([Line(b"x" * LARGEST)])


@pytest.mark.slow
def test_any_bytes_are_refused_politely() -> None:
    from hypothesis import given, settings, strategies

    @settings(max_examples=300, deadline=None)
    @given(strategies.binary(max_size=200))
    def bytes_are(data: bytes) -> None:
        refused: set[str] = set()
        for one in split(data):
            try:
                decode(read_line(one).sentence)
            except NmeaError as error:
                refused.add(error.reason)
        assert refused <= {"length", "form", "checksum", "kind", "field"}

    bytes_are()


@pytest.mark.slow
def test_any_fields_are_read_or_refused_and_what_is_read_is_written_the_same_in_value() -> None:
    from hypothesis import given, settings, strategies

    texts = strategies.lists(strategies.text("0123456789.-AVNSEWTMK", max_size=8), max_size=20)

    @settings(max_examples=300, deadline=None)
    @given(strategies.sampled_from(sorted(SENTENCES)), texts)
    def fields_are(kind: str, parts: list[str]) -> None:
        try:
            found = decode(line(f"II{kind}," + ",".join(parts)))
        except NmeaError:
            return
        again = decode(encode(found))
        for name, value in found.fields.items():
            rule = SENTENCES[kind].fields[name]
            tolerance = 0.51 * 10.0**-rule.decimals if isinstance(rule, Number) else 0.006
            back = again[name]
            same = back == value or math.isclose(float(back) % 360.0, float(value) % 360.0, abs_tol=tolerance)
            assert same, name

    fields_are()


def test_without_pynmeagps_the_extra_is_named(monkeypatch):
    from seatrial.data.nmea import sentences as nmea

    nmea._library.cache_clear()
    monkeypatch.setitem(__import__("sys").modules, "pynmeagps", None)
    with pytest.raises(DataError, match=r"pip install 'seatrial\[nmea\]'"):
        encode(built("HDT"))
    nmea._library.cache_clear()


@pytest.mark.parametrize("place", [(35.0, 139.0), (-60.0, 179.9999), (0.0, 0.0), (78.0, -15.0)])
@pytest.mark.parametrize("point", [(0.0, 0.0), (1234.5, -6789.0), (-20000.0, 15000.0)])
def test_datum_there_and_back(place, point):
    datum = Datum(*place)
    x, y = datum.north_east(*datum.place(*point))
    assert (x, y) == (pytest.approx(point[0], abs=1e-6), pytest.approx(point[1], abs=1e-6))


def test_a_minute_of_latitude_is_about_a_mile():
    x, y = Datum(45.0, 10.0).north_east(45.0 + 1 / 60.0, 10.0)
    assert x == pytest.approx(1852.2, abs=0.2)  # of the meridian at 45 deg
    assert y == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(DataError, match="datum at latitude 95"):
        Datum(95.0, 0.0)
