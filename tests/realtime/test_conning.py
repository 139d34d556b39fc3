"""What each order does to a ship, unit by unit and sign by sign; who has command, and what is left alone."""

from __future__ import annotations

import math

import pytest

from seatrial.core.constants import MILE
from seatrial.data.nmea.sentences import SENTENCES, Sentence, decode, encode
from seatrial.data.nmea.ship import Fittings
from seatrial.realtime.conning import TELEGRAPH, Conning, SteeringControl, shafts, thrusters
from seatrial.realtime.helm import ranges
from seatrial.realtime.on_wire import exact, fitted, unsaid
from seatrial.realtime.wire import OTHER, Authority, WireError
from seatrial.ships.files import load
from seatrial.simulate.approach import approach

DEG = math.pi / 180.0


def said(kind: str, **fields) -> Sentence:
    """As it comes off the wire."""
    null = dict.fromkeys(SENTENCES[kind].fields)
    assert set(fields) <= set(null)
    return decode(encode(Sentence("AG", kind, {**null, **fields})))


def conning(name: str = "kvlcc2_l7", **more) -> Conning:
    ship = load(name)
    return Conning(ship, fitted(ship, Fittings()), full=10.0, **more)


def heading(course: float, **more) -> Sentence:
    return said("HTC", override="V", steermode="H", turnmode="N", cmdheading=course, headingref="T", **more)


def xte(miles: float, side: str) -> Sentence:
    return said("XTE", gwarn="A", LCcwarn="A", ctrkerr=miles, dirs=side, disUnit="N")


@pytest.mark.parametrize("angle", [-12.5, 0.0, 20.0])
def test_rudder_order_is_positive_to_starboard(angle):
    con = conning()
    assert con.take(said("ROR", stbdrudderorder=angle, stbdrudderstatus="A"), "a", 0.0) == {"delta": angle * DEG}
    assert con.mode == "rudder"
    assert con.take(said("ROR", stbdrudderorder=angle, stbdrudderstatus="V"), "a", 0.0) == {}
    assert con.counts["unfit"] == 1


def test_two_rudders_obey_their_own_fields():
    con = conning("twin_virtual")
    both = said("ROR", stbdrudderorder=5.0, stbdrudderstatus="A", portrudderorder=-3.0, portrudderstatus="A")
    assert con.take(both, "a", 0.0) == {"delta_1": pytest.approx(-3.0 * DEG), "delta_2": pytest.approx(5.0 * DEG)}
    one = said("ROR", stbdrudderorder=5.0, stbdrudderstatus="A", portrudderstatus="V")
    assert con.take(one, "a", 0.0) == {"delta_2": pytest.approx(5.0 * DEG)}


@pytest.mark.parametrize(("side", "sign"), [("L", -1.0), ("R", 1.0)])
def test_heading_control_by_hand_turns_to_the_side_named(side, sign):
    con = conning()
    for fields in ({"override": "A", "steermode": "H"}, {"override": "V", "steermode": "M"}, {"steermode": "R"}):
        sentence = said("HTC", cmdrudderang=10.0, cmdrudderdir=side, **fields)
        assert con.take(sentence, "a", 0.0) == {"delta": pytest.approx(sign * 10.0 * DEG)}
    assert con.take(said("HTC", steermode="M", cmdrudderang=10.0), "a", 0.0) == {}  # to which side?
    assert con.counts["unfit"] == 1


@pytest.mark.parametrize(
    ("here", "course", "sign"), [(0.0, 20.0, 1), (0.0, 340.0, -1), (350.0, 10.0, 1), (10.0, 350.0, -1)]
)
def test_heading_to_steer_is_approached_the_shorter_way(here, course, sign):
    con = conning()
    assert con.take(heading(course), "a", 0.0) == {}
    rudder = con.steered(here * DEG, 0.0, 0.1, 0.1)["delta"]
    assert math.copysign(1.0, rudder) == sign
    assert con.mode == "heading"


def test_rudder_limit_and_turn_rate_of_heading_control():
    con = conning()
    con.take(heading(90.0, cmdrudderlimit=5.0), "a", 0.0)
    assert con.steered(0.0, 0.0, 0.1, 0.1)["delta"] == pytest.approx(5.0 * DEG)
    slow = said("HTC", override="V", steermode="H", turnmode="T", cmdturnrate=60.0, cmdheading=90.0, headingref="T")
    con = conning()
    con.take(slow, "a", 0.0)
    con.steered(0.0, 0.0, 0.1, 0.1)
    # one degree a second: at that rate nothing is left to correct but the tenth of a degree it is behind
    assert con.control.rate == pytest.approx(DEG)
    assert abs(con.steered(0.1 * DEG, DEG, 0.2, 0.1)["delta"]) < 0.5 * DEG
    wide = said("HTC", steermode="H", turnmode="R", cmdturnradius=1.0, cmdheading=90.0, headingref="T")
    con.take(wide, "a", 0.0)
    assert con.control.rate == pytest.approx(con.ship.speed / MILE)


def test_the_rudder_limit_of_a_heading_order_ends_with_it():
    con = conning()
    con.take(heading(90.0, cmdrudderlimit=3.0), "a", 0.0)
    assert con.steered(0.0, 0.0, 0.1, 0.1)["delta"] == pytest.approx(3.0 * DEG)
    con.take(said("APB", LCgwarn="A", LCcwarn="A", bearS=90.0, bearSu="T"), "a", 0.2)
    assert con.steered(0.0, 0.0, 0.2, 0.1)["delta"] == pytest.approx(35.0 * DEG)
    con.take(heading(90.0, cmdrudderlimit=3.0), "a", 0.3)
    track = said("APB", LCgwarn="A", LCcwarn="A", ctrkerr=0.5, dirs="R", ctrkUnit="N", bearO2D=90.0, bearO2Du="T")
    con.take(track, "a", 0.4)
    assert con.steered(0.0, 0.0, 0.4, 0.1)["delta"] == pytest.approx(35.0 * DEG)


def test_magnetic_headings_and_reports_are_no_orders():
    con = conning()
    con.take(said("HTC", steermode="H", cmdheading=10.0, headingref="M"), "a", 0.0)
    assert con.counts["unfit"] == 1
    for report in (
        said("HTC", steermode="H", cmdheading=10.0, headingref="T", status="R"),
        said("TRC", thrusternum=1, dmdrpm=10.0, rpmmode="P", status="R"),
        said("ETL", msgtype="A", engtelposind="03"), said("HTC", status="R"),
    ):  # fmt: skip
        assert con.take(report, "b", 0.0) == {}
    assert con.commander == ""
    assert con.mode == "none"


@pytest.mark.parametrize(("side", "sign"), [("L", -1), ("R", 1)])
def test_track_follower_steers_to_the_side_that_is_told(side, sign):
    apb = said("APB", LCgwarn="A", LCcwarn="A", ctrkerr=0.01, dirs=side, ctrkUnit="N", bearO2D=0.0, bearO2Du="T")
    con = conning()
    con.take(apb, "a", 0.0)
    assert con.mode == "track"
    assert math.copysign(1.0, con.steered(0.0, 0.0, 0.1, 0.1)["delta"]) == sign
    by_hand = conning()
    track = said("HTC", override="V", steermode="T", turnmode="N", cmdtrack=0.0, headingref="T")
    by_hand.take(track, "a", 0.0)
    assert by_hand.steered(0.0, 0.0, 0.1, 0.1)["delta"] == pytest.approx(0.0)
    by_hand.take(xte(0.01, side), "a", 0.1)
    by_hand.take(track, "a", 0.15)  # saying the track again does not forget the offset
    assert math.copysign(1.0, by_hand.steered(0.0, 0.0, 0.2, 0.1)["delta"]) == sign
    assert by_hand.control.across == pytest.approx(-sign * 0.01 * MILE)


def test_cross_track_error_without_a_track_and_invalid_guidance_do_nothing():
    con = conning()
    assert con.take(xte(0.1, "L"), "a", 0.0) == {}
    assert con.mode == "none"
    lost = said("APB", LCgwarn="V", LCcwarn="A", ctrkerr=0.1, dirs="L", ctrkUnit="N", bearO2D=0.0, bearO2Du="T")
    con.take(lost, "a", 0.0)
    assert con.mode == "none"
    con.take(said("APB", LCgwarn="A", LCcwarn="A", bearS=45.0, bearSu="T"), "a", 0.0)
    assert con.mode == "heading"
    assert con.control.course == pytest.approx(45.0 * DEG)


def test_propulsion_is_revolutions_per_minute_or_per_cent_positive_ahead():
    con = conning("esso_osaka_3m_harbour")  # 20 1/s at most
    assert con.take(said("PRC", rpmdemand=600.0, rpmdemandstatus="R", engineshaftnum=0), "a", 0.0) == {"n_P": 10.0}
    assert con.take(said("PRC", rpmdemand=-50.0, rpmdemandstatus="P"), "a", 0.0) == {"n_P": -10.0}
    assert con.take(said("PRC", leverdmdpos=25.0, leverdmdstatus="A", rpmdemandstatus="V"), "a", 0.0) == {"n_P": 5.0}
    assert con.take(said("PRC", leverdmdpos=25.0, leverdmdstatus="V"), "a", 0.0) == {}
    assert con.take(said("PRC", rpmdemand=9000.0, rpmdemandstatus="R"), "a", 0.0) == {"n_P": 20.0}
    assert con.counts["clipped"] == 1
    free = conning()  # no limit of the gear: a quarter beyond the approach at most
    assert free.take(said("PRC", rpmdemand=90000.0, rpmdemandstatus="R"), "a", 0.0) == {"n_P": 12.5}


def test_shafts_by_number_odd_to_starboard_even_to_port():
    con = conning("twin_virtual")
    assert con.take(said("PRC", rpmdemand=60.0, rpmdemandstatus="R", engineshaftnum=1), "a", 0.0) == {"n_P_2": 1.0}
    assert con.take(said("PRC", rpmdemand=60.0, rpmdemandstatus="R", engineshaftnum=2), "a", 0.0) == {"n_P_1": 1.0}
    both = con.take(said("PRC", rpmdemand=60.0, rpmdemandstatus="R", engineshaftnum=0), "a", 0.0)
    assert both == {"n_P_1": 1.0, "n_P_2": 1.0}
    assert con.take(said("PRC", rpmdemand=60.0, rpmdemandstatus="R", engineshaftnum=7), "a", 0.0) == {}


def test_the_telegraph_is_the_same_astern_and_grows_from_stop_to_full():
    assert [TELEGRAPH[f"0{k}"] for k in range(6)] == [0.0, 0.3, 0.45, 0.65, 0.85, 1.0]
    assert all(TELEGRAPH[f"1{k}"] == -TELEGRAPH[f"0{k}"] for k in range(1, 6))
    assert len(TELEGRAPH) == 11


@pytest.mark.parametrize("position", TELEGRAPH)
def test_telegraph(position):
    con = conning()
    ordered = con.take(said("ETL", time=0.0, msgtype="O", engtelposind=position, operatinglocind="B"), "a", 0.0)
    assert ordered == {"n_P": pytest.approx(10.0 * TELEGRAPH[position])}
    assert (TELEGRAPH[position] < 0.0) == (position > "10")


def test_full_on_the_telegraph_is_that_of_the_page_and_ends_where_the_engine_does():
    osaka = load("esso_osaka_3m")  # 20 1/s at most, 10 hold the approach speed
    full = Conning(osaka, fitted(osaka, Fittings()))
    order = said("ETL", time=0.0, msgtype="O", engtelposind="05", operatinglocind="B")
    assert full.take(order, "a", 0.0) == {"n_P": pytest.approx(approach(osaka)[1])}
    free = conning()
    huge = said("PRC", rpmdemand=99999.0, rpmdemandstatus="R")
    assert free.take(huge, "a", 0.0) == {"n_P": ranges(free.ship, 10.0)["n_P"].high}


@pytest.mark.parametrize(("number", "obeyed"), [(None, True), (0, True), (1, True), (2, False), (3, False)])
def test_a_single_shaft_is_number_0_or_1(number, obeyed):
    con = conning()
    order = said("PRC", rpmdemand=60.0, rpmdemandstatus="R", engineshaftnum=number)
    assert con.take(order, "a", 0.0) == ({"n_P": pytest.approx(1.0)} if obeyed else {})
    assert con.counts["taken" if obeyed else "unfit"] == 1


def test_why_orders_are_refused_and_what_a_ship_lacks():
    con = conning()
    assert con.refusal("a", 0.0) == ""
    con.take(heading(40.0), "a", 0.0)
    assert con.refusal("a", 5.0) == ""
    assert con.refusal("b", 5.0) == "a has command"
    assert con.refusal("b", 10.1) == ""  # a has been silent for longer than 10 s
    con.listen(False)
    assert "not handed over" in con.refusal("a", 5.0)
    assert con.commander == ""
    con.listen(True)
    assert con.refusal("b", 5.0) == ""
    assert not any(con.missing(kind) for kind in ("HTC", "ROR", "PRC"))
    otter = conning("otter")
    assert [bool(otter.missing(kind)) for kind in ("HTC", "ROR", "PRC")] == [True, True, False]
    assert conning(steers=False).missing("HTC")


def test_a_ship_whose_model_keeps_its_speed_has_no_shaft():
    con = conning("zeefakkel")
    assert shafts(con.ship) == ()
    assert con.take(said("ETL", time=0.0, msgtype="O", engtelposind="05", operatinglocind="B"), "a", 0.0) == {}
    assert con.take(said("PRC", rpmdemand=60.0, rpmdemandstatus="R"), "a", 0.0) == {}
    assert con.counts["unfit"] == 2
    fittings = fitted(con.ship, Fittings())
    assert "shaft" in unsaid("RPM", exact(con.ship.model.controls, fittings, 10.0), fittings)


def test_thrusters_by_number_odd_at_the_bow_even_at_the_stern():
    con = conning("esso_osaka_3m_harbour")
    assert thrusters(con.ship) == {1: ("n_bow", None), 2: ("n_stern", None)}
    port = said("TRC", thrusternum=1, dmdrpm=-50.0, rpmmode="P", operatinglocind="B", status="C")
    assert con.take(port, "a", 0.0) == {"n_bow": -15.0}
    assert con.take(said("TRC", thrusternum=2, dmdrpm=60.0, rpmmode="R", status="C"), "a", 0.0) == {"n_stern": 1.0}
    assert con.take(said("TRC", thrusternum=3, dmdrpm=60.0, rpmmode="R", status="C"), "a", 0.0) == {}
    tug = conning("qiuxin5")
    assert thrusters(tug.ship) == {2: ("n_1", "alpha_1"), 4: ("n_2", "alpha_2")}
    turned = said("TRC", thrusternum=4, dmdrpm=300.0, rpmmode="R", dmdazimuth=270.0, status="C")
    assert tug.take(turned, "a", 0.0) == {"n_2": 5.0, "alpha_2": pytest.approx(-90.0 * DEG)}


def test_one_has_command_until_he_falls_silent():
    con = conning(hold=10.0)
    con.take(heading(10.0), "a", 0.0)
    assert con.take(heading(90.0), "b", 5.0) == {}
    assert con.commander == "a"
    assert con.counts["refused"] == 1
    assert con.control.course == pytest.approx(10.0 * DEG)
    con.steered(0.0, 0.0, 9.0, 0.1)
    assert not con.stale
    con.steered(0.0, 0.0, 10.5, 0.1)
    assert con.stale
    assert con.mode == "heading"  # the last order holds
    con.take(heading(90.0), "b", 11.0)
    assert con.commander == "b"
    assert not con.stale


def test_any_valid_sentence_of_who_has_command_keeps_it():
    con = conning(hold=10.0)
    con.take(heading(10.0), "a", 0.0)
    con.take(said("HDT", headingT=1.0, headingTu="T"), "a", 8.0)  # orders nothing
    con.take(OTHER, "a", 16.0)  # valid, but not read here
    con.take(said("ROR", stbdrudderorder=5.0, stbdrudderstatus="V"), "a", 24.0)  # unfit
    con.take(said("HDT", headingT=1.0, headingTu="T"), "b", 33.0)  # of another it counts for nothing
    assert con.take(heading(90.0), "b", 33.0) == {}
    assert con.commander == "a"
    con.watch(33.9)
    assert not con.stale
    con.take(heading(90.0), "b", 34.1)
    assert con.commander == "b"


def test_only_who_is_allowed_has_command():
    con = conning(authority=Authority.of(["192.168.1.5", "localhost:4711"]))
    for sender in ("udp 127.0.0.1:4712", "udp 192.168.1.50:1", "udp 10.0.0.1:4711", "a", ""):
        assert con.take(said("ROR", stbdrudderorder=5.0, stbdrudderstatus="A"), sender, 0.0) == {}
        assert con.commander == ""
    assert con.counts["refused"] == 5
    for sender in ("udp 127.0.0.1:4711", "tcp 192.168.1.5:99"):
        con.reset()
        assert con.take(said("ROR", stbdrudderorder=5.0, stbdrudderstatus="A"), sender, 0.0)
        assert con.commander == sender


@pytest.mark.parametrize("text", ["", "host", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "127.0.0.1:x", "::1"])
def test_an_allowed_address_that_is_none_is_refused(text):
    with pytest.raises(WireError, match="write an IPv4 address"):
        Authority.of([text])


def test_a_track_that_nobody_tells_any_more_is_followed_by_its_direction():
    con = conning(hold=10.0)
    con.take(said("HTC", steermode="T", cmdtrack=0.0, headingref="T"), "a", 0.0)
    con.take(xte(0.01, "L"), "a", 0.0)
    assert con.steered(0.0, 0.0, 1.0, 0.1)["delta"] < 0.0
    con.control._integral = 0.0
    assert con.steered(0.0, 0.0, 11.0, 0.1)["delta"] == pytest.approx(0.0)


def test_steering_control_holds_against_a_steady_moment():
    """A ship with a bias of the rudder: only integral action brings it back to the heading."""
    ship = load("kvlcc2_l7")
    control = SteeringControl.of(ship, 35.0 * DEG)
    control.steer(20.0 * DEG)
    K, T, psi, r, dt = 1.8 * ship.speed / ship.L_pp, 2.5 * ship.L_pp / ship.speed, 0.0, 0.0, 0.1
    for _ in range(int(60.0 * ship.L_pp / ship.speed / dt)):
        delta = control.rudder(psi, r, dt) + 3.0 * DEG
        psi, r = psi + r * dt, r + dt * (K * delta - r) / T
    assert psi == pytest.approx(20.0 * DEG, abs=0.1 * DEG)
    control.let_go()
    assert control.rudder(psi, r, dt) == 0.0


def test_a_craft_without_a_rudder_takes_no_heading():
    """Nothing would carry it out: it is unfit, not taken, and the engines are obeyed."""
    con = conning("otter")
    assert con.take(heading(40.0), "a", 0.0) == {}
    assert con.counts == {"unfit": 1}
    assert con.mode == "none"
    assert set(con.take(said("ETL", engtelposind="05", enginenum=None, msgtype="O"), "a", 0.0)) == {
        "n_port", "n_starboard"}  # fmt: skip
