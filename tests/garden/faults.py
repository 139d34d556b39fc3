# ruff: noqa: E501 -- the list is a table, one fault a line
"""The list of planted faults, each with the culprit that has to be named.

A culprit is the key of a finding or of a suspect, with a channel where the key alone is not enough: ``lag:psi``.  Any
of those listed counts as the right one.  `visible` is False where the data cannot show the culprit, and `why` says so;
such a fault must not be silently wrong all the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import plants as p
from .logs import DEG, Folder
from .plants import Plant

KN, FT = 3600 / 1852, 1 / 0.3048


@dataclass(frozen=True)
class Fault:
    """One planted fault."""

    name: str
    planted: str
    culprits: tuple[str, ...]
    plant: Plant
    weather: str = "calm"
    visible: bool = True
    why: str = ""


def _each(change) -> Plant:
    return lambda f: f.each(change)


def _meta(**keys) -> Plant:
    from dataclasses import replace

    def plant(f: Folder) -> Folder:
        return replace(f, meta={**f.meta, **keys})

    return plant


FAULTS: tuple[Fault, ...] = (
    # -- surroundings
    Fault("current", "a current of .5 m/s that nobody told of", ("current",), p.drift(0.5, 70 * DEG)),
    Fault("current_weak", "a current of .2 m/s", ("current",), p.drift(0.2, 200 * DEG)),
    Fault("current_turning", "a current of .4 m/s, another way in each trial", ("current",), p.drift(0.4, 0.0, 1.0)),
    Fault("wind_hidden", "10 m/s of wind, no anemometer", ("wind", "no_wind"), p.without("U_T", "gamma_T"), "wind"),
    Fault("wind_zero", "10 m/s of wind, logged as zero", ("wind", "zeros:U_T"), p.constant(0.0, "U_T", "gamma_T"), "wind"),
    Fault("wind_to", "the wind's direction is where it goes to", ("wind_to",), p.plus(np.pi, "gamma_T"), "wind"),
    Fault("wind_apparent", "the apparent wind logged as the true one", ("apparent_as_true",), _each(p.apparent), "wind"),
    Fault("wind_relative", "true wind, counted from the bow", ("apparent_as_true",), _each(p.relative), "wind"),
    Fault("wind_knots", "wind in knots read as m/s", ("wind_scale", "unit:U_T"), p.times(KN, "U_T"), "wind"),
    Fault("wind_degrees", "direction of the wind in degrees read as radians", ("unit:gamma_T",), p.times(1 / DEG, "gamma_T"), "wind"),
    Fault("shallow", "water of 1.5 draughts", ("shallow_water", "model"), p.sailed_by(p.shallow), visible=False,
          why="a hull in shallow water is a hull of other coefficients"),
    # -- heading
    Fault("heading_bias", "compass 3 deg off", ("heading_bias",), p.plus(3 * DEG, "psi")),
    Fault("heading_bias_1", "compass 1 deg off", ("heading_bias",), p.plus(-1 * DEG, "psi")),
    Fault("heading_magnetic", "magnetic heading, variation of 8 deg", ("heading_bias",), p.plus(-8 * DEG, "psi")),
    Fault("heading_course", "course over ground logged as heading", ("course_as_heading",), _each(p.course)),
    Fault("heading_late", "compass late by 2 s", ("lag:psi",), p.late(2.0, "psi")),
    Fault("heading_spike", "one heading off by 40 deg", ("spike:psi",), p.spikes(40 * DEG, 1, "psi", only="zigzag_20_s")),
    Fault("heading_stuck", "compass stuck for a tenth of each trial", ("frozen:psi",), p.held(0.1, "psi")),
    Fault("heading_degrees", "heading in degrees read as radians", ("unit:psi",), p.times(1 / DEG, "psi")),
    Fault("heading_small", "heading in radians converted as degrees", ("unit:psi",), p.times(DEG, "psi")),
    Fault("heading_sign", "heading counts counterclockwise", ("sign:psi",), p.times(-1.0, "psi")),
    Fault("heading_coarse", "heading to 5 deg", ("coarse:psi",), p.coarse(5 * DEG, "psi")),
    Fault("heading_sentinel", "heading of 511 deg where there was none", ("sentinel:psi", "spike:psi"), p.filled(511 * DEG, 0.02, "psi", each=7)),
    # -- rate of turn
    Fault("gyro_bias", "rate of turn 2 deg/min off", ("gyro_bias",), p.plus(2 * DEG / 60, "r")),
    Fault("gyro_scale", "rate of turn 6 % too large", ("gyro_scale", "scale:r"), p.times(1.06, "r")),
    Fault("rate_late", "rate of turn late by 3 s", ("lag:r",), p.late(3.0, "r")),
    Fault("rate_sign", "rate of turn counts to port", ("sign:r",), p.times(-1.0, "r")),
    Fault("rate_per_second", "deg/min read as deg/s", ("unit:r",), p.times(60.0, "r")),
    Fault("rate_per_minute", "deg/s read as deg/min", ("unit:r",), p.times(1 / 60, "r")),
    Fault("rate_degrees", "deg/s read as rad/s", ("unit:r",), p.times(1 / DEG, "r")),
    Fault("rate_zero", "no rate of turn, zeros instead", ("zeros:r", "frozen:r"), p.constant(0.0, "r")),
    Fault("rate_spikes", "five rates off by 60 deg/min", ("spike:r",), p.spikes(1 * DEG, 5, "r")),
    # -- positions
    Fault("gnss_late", "receiver late by 3 s", ("lag:x",), p.late(3.0, "x", "y")),
    Fault("gnss_late_1", "receiver late by 1 s", ("lag:x",), p.late(1.0, "x", "y")),
    Fault("antenna_aft", "antenna 100 m abaft midship", ("lever_arm",), p.antenna(-100.0, 0.0)),
    Fault("antenna_fore", "antenna 60 m ahead, 15 m to starboard", ("lever_arm",), p.antenna(60.0, 15.0)),
    Fault("axes_swapped", "x is east and y north", ("axes:x",), p.swapped("x", "y")),
    Fault("east_sign", "y counts to the west", ("sign:y", "axes:y"), p.times(-1.0, "y")),
    Fault("north_sign", "x counts to the south", ("sign:x", "axes:x"), p.times(-1.0, "x")),
    Fault("position_feet", "feet read as metres", ("unit:x",), p.times(FT, "x", "y")),
    Fault("position_km", "kilometres read as metres", ("unit:x",), p.times(1e-3, "x", "y")),
    Fault("gnss_spike", "three fixes off by 200 m", ("spike:x",), p.spikes(200.0, 3, "x")),
    Fault("gnss_sentinel", "-9999 where there was no fix", ("sentinel:x", "spike:x"), p.filled(-9999.0, 0.02, "x", "y", each=9)),
    Fault("gnss_stuck", "the last fix repeated for a twentieth of each trial", ("frozen:x",), p.held(0.05, "x", "y")),
    Fault("gnss_zero", "zeros where there was no fix", ("zeros:x", "spike:x", "sentinel:x"), p.filled(0.0, 0.02, "x", "y", each=5)),
    # -- speeds
    Fault("speed_knots", "knots read as m/s", ("unit:u",), p.times(KN, "u", "v_m")),
    Fault("speed_kmh", "km/h read as m/s", ("unit:u",), p.times(3.6, "u", "v_m")),
    Fault("surge_knots", "surge alone in knots read as m/s", ("unit:u",), p.times(KN, "u")),
    Fault("log_scale", "speed log 5 % too high", ("log_scale", "scale:u"), p.times(1.05, "u", "v_m")),
    Fault("log_bias", "surge .3 m/s too high", ("log_bias", "log_scale", "bias:u"), p.plus(0.3, "u")),
    Fault("speed_total", "speed over ground logged as surge, sway as zero", ("speed_as_surge",), _each(p.speed_as_surge)),
    Fault("speed_water", "speeds through the water in a current", ("through_water", "current"), _each(p.water), "current"),
    Fault("sway_sign", "sway counts to port", ("sign:v_m", "axes:v_m"), p.times(-1.0, "v_m")),
    Fault("sway_at_bow", "sway measured 130 m ahead of midship", ("lever_arm", "lever_arm:v_m"), p.log_at(130.0)),
    Fault("sway_zero", "no sway, zeros instead", ("zeros:v_m", "frozen:v_m"), p.constant(0.0, "v_m")),
    Fault("speed_earth", "velocities north and east called surge and sway", ("axes:u",), _each(p.earth)),
    Fault("speed_swapped", "surge and sway exchanged", ("axes:u",), p.swapped("u", "v_m")),
    Fault("speed_late", "speeds late by 5 s", ("lag:u",), p.late(5.0, "u", "v_m")),
    Fault("speed_sentinel", "surge of 99.9 where there was none", ("sentinel:u", "spike:u"), p.filled(99.9, 0.01, "u", each=11)),
    Fault("surge_sign", "surge counts astern", ("sign:u", "axes:u"), p.times(-1.0, "u")),
    Fault("surge_zeros", "surge zero for a twentieth of each trial", ("zeros:u", "frozen:u", "spike:u"), p.filled(0.0, 0.05, "u")),
    # -- rudder
    Fault("rudder_offset", "rudder indicator 1.5 deg off", ("rudder_offset",), p.plus(1.5 * DEG, "delta")),
    Fault("rudder_offset_small", "rudder indicator .7 deg off", ("rudder_offset",), p.plus(-0.7 * DEG, "delta")),
    Fault("rudder_scale", "rudder angles 10 % too large", ("rudder_scale",), p.times(1.1, "delta")),
    Fault("rudder_sides", "rudder angles 12 % too large to port only", ("rudder_sides",), p.side(1.12, 1.0)),
    Fault("rudder_sign", "rudder counts to port", ("sign:delta",), p.times(-1.0, "delta")),
    Fault("rudder_stuck", "rudder indicator stuck for a quarter of each trial", ("frozen:delta",), p.held(0.25, "delta")),
    Fault("rudder_zero", "rudder zero throughout", ("zeros:delta", "frozen:delta"), p.constant(0.0, "delta")),
    Fault("rudder_order", "the order logged as the angle", ("order_as_measured", "lag:delta"), _each(p.ordered)),
    Fault("rudder_late", "rudder late by 4 s", ("lag:delta",), p.late(4.0, "delta")),
    Fault("rudder_degrees", "rudder in degrees read as radians", ("unit:delta",), p.times(1 / DEG, "delta")),
    Fault("rudder_small", "rudder in radians converted as degrees", ("unit:delta",), p.times(DEG, "delta")),
    Fault("rudder_spikes", "four rudder angles off by 30 deg", ("spike:delta",), p.spikes(30 * DEG, 4, "delta")),
    # -- propeller
    Fault("revolutions_percent", "percent of full revolutions read as rpm", ("revolutions_scale", "unit:n_P"), p.times(100 / 60 / 1.861, "n_P")),
    Fault("revolutions_scale", "revolutions 6 % too low", ("revolutions_scale",), p.times(0.94, "n_P")),
    Fault("revolutions_rpm", "rpm read as 1/s", ("unit:n_P",), p.times(60.0, "n_P")),
    Fault("revolutions_slow", "1/s read as rpm", ("unit:n_P",), p.times(1 / 60, "n_P")),
    Fault("revolutions_zero", "no revolutions, zeros instead", ("zeros:n_P",), p.constant(0.0, "n_P")),
    Fault("revolutions_sign", "revolutions ahead are negative", ("sign:n_P",), p.times(-1.0, "n_P")),
    Fault("revolutions_gaps", "revolutions zero in single rows", ("zeros:n_P", "spike:n_P"), p.filled(0.0, 0.02, "n_P", each=13)),
    # -- clock
    Fault("clock_fast", "time base 1.01 of the true one", ("time_scale",), p.clock(lambda t: 1.01 * t)),
    Fault("clock_rate", "time base .9 of the true one", ("time_scale",), p.clock(lambda t: 0.9 * t)),
    Fault("clock_ms", "milliseconds read as seconds", ("unit:t", "time_scale"), p.clock(lambda t: 1000.0 * t)),
    Fault("rows_twice", "every tenth row twice", ("time_repeats",), p.rows(lambda n: np.sort(np.r_[0:n, 0:n:10]))),
    Fault("rows_back", "a block of rows out of order", ("time_back",), p.rows(lambda n: np.r_[0:100, 120:140, 100:120, 140:n])),
    Fault("rows_missing", "one row in fifteen missing", ("missing_rows",), p.rows(lambda n: np.flatnonzero(np.arange(n) % 15 != 7)),
          visible=True),
    # -- the ship
    Fault("mirrored", "port and starboard exchanged throughout", ("mirrored",), p.times(-1.0, "y", "psi", "v_m", "r", "delta"),
          visible=False, why="the mirror image of a ship is a ship; only the asymmetry of the propeller differs"),
    Fault("ship_model", "full scale logs under the length of the model", ("scale", "length"), _meta(L_pp=7.0)),
    Fault("ship_other", "another hull than the ship file's", ("model",), p.sailed_by(p.another), visible=False,
          why="coefficients that are not free are wrong; any of several could be it"),
    Fault("draught", "85 % of the draught of the ship file", ("model", "draught"), p.sailed_by(p.lighter), visible=False,
          why="a hull at another draught is a hull of other coefficients"),
    Fault("density", "fresh water under the density of sea water", ("density",), _meta(water_density=1000.0), visible=False,
          why="every force of the water, and the mass displaced, is proportional to it: no motion changes"),
)  # fmt: skip

BY_NAME = {fault.name: fault for fault in FAULTS}


def _picked(names: str) -> tuple[Fault, ...]:
    """Faults of the full scale ship, at the scale of another."""
    return tuple(BY_NAME[name] for name in names.split())


OTHERS: dict[str, tuple[Fault, ...]] = {
    "esso": (
        *_picked("current wind_hidden wind_zero heading_bias heading_late heading_course gyro_bias gyro_scale rate_sign "
                 "rate_degrees gnss_late antenna_aft axes_swapped speed_knots log_scale log_bias sway_sign sway_zero "
                 "speed_late rudder_offset rudder_scale rudder_sides rudder_sign rudder_late rudder_degrees "
                 "revolutions_scale revolutions_rpm revolutions_slow revolutions_zero clock_fast"),
        Fault("wind_to", "the wind's direction is where it goes to", ("wind_to",), p.plus(np.pi, "gamma_T"), "wind"),
        Fault("revolutions_percent", "percent of full revolutions read as rpm", ("revolutions_scale", "unit:n_P"), p.times(100 / 60 / 10.6, "n_P")),
    ),
    "twin": (
        *_picked("current wind_hidden heading_bias heading_late gyro_bias rate_sign rate_degrees gnss_late antenna_aft "
                 "speed_knots log_scale sway_sign speed_late clock_fast"),
        Fault("shafts_exchanged", "revolutions of port and starboard exchanged", ("exchange.n_P",), p.swapped("n_P_1", "n_P_2")),
        Fault("shafts_scale", "revolutions of both shafts 6 % too low", ("revolutions_scale", "scale.n_P_1", "scale.n_P_2"), p.times(0.94, "n_P_1", "n_P_2")),
        Fault("shaft_scale", "revolutions of the starboard shaft 8 % too low", ("scale.n_P_2",), p.times(0.92, "n_P_2")),
        Fault("shaft_rpm", "rpm of the starboard shaft read as 1/s", ("unit:n_P_2",), p.times(60.0, "n_P_2")),
        Fault("shaft_zero", "no revolutions of the port shaft, zeros instead", ("zeros:n_P_1",), p.constant(0.0, "n_P_1")),
        Fault("shaft_sign", "revolutions of the port shaft ahead are negative", ("sign:n_P_1",), p.times(-1.0, "n_P_1")),
        Fault("rudders_exchanged", "rudders of port and starboard exchanged", ("exchange.delta",), p.swapped("delta_1", "delta_2")),
        Fault("rudders_offset", "both rudder indicators 1.5 deg off", ("rudder_offset", "offset.delta"), p.chain(p.plus(1.5 * DEG, "delta_1"), p.plus(1.5 * DEG, "delta_2"))),
        Fault("rudder_offset_port", "port rudder indicator 2 deg off", ("offset.delta_1", "rudder_offset:delta_1"), p.plus(2 * DEG, "delta_1")),
        Fault("rudder_scale_port", "angles of the port rudder 10 % too large", ("scale.delta_1", "rudder_scale:delta_1"), p.times(1.1, "delta_1")),
        Fault("rudders_sign", "both rudders count to port", ("sign:delta_1",), p.times(-1.0, "delta_1", "delta_2")),
        Fault("rudder_sign_starboard", "starboard rudder counts to port", ("sign:delta_2", "scale.delta_2"), p.times(-1.0, "delta_2")),
        Fault("rudder_degrees_port", "port rudder in degrees read as radians", ("unit:delta_1",), p.times(1 / DEG, "delta_1")),
        Fault("rudder_zero_starboard", "starboard rudder zero throughout", ("zeros:delta_2", "frozen:delta_2"), p.constant(0.0, "delta_2")),
        Fault("rudder_stuck_starboard", "starboard rudder indicator stuck for a quarter of each trial", ("frozen:delta_2",), p.held(0.25, "delta_2")),
        Fault("rudder_jammed", "starboard rudder jammed at 5 deg; its order is logged", ("scale.delta_2", "offset.delta_2", "sign.delta_2", "stuck.delta_2"), p.sailed_by(p.jammed)),
        Fault("rudders_late", "both rudders late by 4 s", ("lag:delta", "lag:delta_1", "delay.delta_1", "delay.delta_2"), p.late(4.0, "delta_1", "delta_2")),
    ),
    "tug": (
        *_picked("current wind_hidden heading_bias heading_late gyro_bias rate_sign rate_degrees gnss_late antenna_aft "
                 "axes_swapped speed_knots log_scale sway_sign sway_zero speed_late clock_fast"),
        Fault("azimuths_offset", "both azimuths 3 deg off", ("offset.alpha", "offset.alpha_1", "offset.alpha_2"), p.chain(p.plus(3 * DEG, "alpha_1"), p.plus(3 * DEG, "alpha_2"))),
        Fault("azimuth_offset", "azimuth 1 5 deg off", ("offset.alpha_1",), p.plus(5 * DEG, "alpha_1")),
        Fault("azimuths_sign", "azimuths count to port", ("sign.alpha",), p.times(-1.0, "alpha_1", "alpha_2")),
        Fault("azimuth_sign", "azimuth 2 counts to port", ("sign.alpha_2",), p.times(-1.0, "alpha_2")),
        Fault("azimuths_degrees", "azimuths in degrees read as radians", ("unit:alpha_1",), p.times(1 / DEG, "alpha_1", "alpha_2")),
        Fault("azimuths_small", "azimuths in radians converted as degrees", ("unit:alpha_1", "scale.alpha_1", "scale.alpha_2"), p.times(DEG, "alpha_1", "alpha_2")),
        Fault("azimuths_astern", "azimuths counted from astern", ("sign:alpha_1",), p.chain(p.plus(np.pi, "alpha_1"), p.plus(np.pi, "alpha_2"))),
        Fault("azimuths_late", "azimuths late by .8 s", ("delay.alpha", "delay.alpha_1", "delay.alpha_2", "lag:alpha_1"), p.late(10.0, "alpha_1", "alpha_2")),
        Fault("azimuth_stuck", "azimuth 1 stuck for a quarter of each trial", ("frozen:alpha_1",), p.held(0.25, "alpha_1")),
        Fault("azimuth_zero", "azimuth 2 zero throughout", ("zeros:alpha_2", "frozen:alpha_2"), p.constant(0.0, "alpha_2")),
        Fault("thrusters_exchanged", "thrusters 1 and 2 exchanged", ("exchange",), p.chain(p.swapped("n_1", "n_2"), p.swapped("alpha_1", "alpha_2"))),
        Fault("azimuths_exchanged", "directions of thrusters 1 and 2 exchanged", ("exchange.alpha",), p.swapped("alpha_1", "alpha_2")),
        Fault("thruster_scale", "revolutions of thruster 1 10 % too low", ("scale.n_1",), p.times(0.9, "n_1")),
        Fault("thrusters_scale", "revolutions of both thrusters 6 % too low", ("revolutions_scale", "scale.n", "scale.n_1", "scale.n_2"), p.times(0.94, "n_1", "n_2")),
        Fault("thruster_rpm", "rpm of thruster 1 read as 1/s", ("unit:n_1",), p.times(60.0, "n_1")),
        Fault("thrusters_slow", "1/s of both thrusters read as rpm", ("unit:n_1",), p.times(1 / 60, "n_1", "n_2")),
        Fault("thruster_zero", "no revolutions of thruster 2, zeros instead", ("zeros:n_2",), p.constant(0.0, "n_2")),
    ),
}  # fmt: skip
"""Those of the other ships."""


def faults(ship: str) -> tuple[Fault, ...]:
    """Faults of a ship of the fleet."""
    return OTHERS.get(ship, FAULTS)


