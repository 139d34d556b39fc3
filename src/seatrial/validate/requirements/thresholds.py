"""Thresholds of the requirements, each with the physics that sets it; no other module of this folder has one.

Speeds are shares of the approach speed U, times are in L/U, rates of velocity over U^2/L, so that one number is valid
for a tug and a tanker.  They are wide: a requirement asks for a plausible ship, not for an accurate one.
"""

from __future__ import annotations

import math

from ...core.values import dataclass

_INF = math.inf


@dataclass(frozen=True)
class Bound:
    """A closed interval for one measured value, and why it lies there."""

    low: float
    high: float
    why: str

    def holds(self, value: float) -> bool:
        """Whether a value lies within; NaN does not."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        if math.isinf(self.high):
            return f"at least {self.low:g}"
        return f"at most {self.high:g}" if math.isinf(self.low) else f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Range:
    """Where ships lie: beyond `usual` a value is doubted, beyond `far` no ship has it."""

    usual: Bound
    far: Bound


def within(low: float, high: float, far_low: float, far_high: float, why: str) -> Range:
    """Usual and possible range of one quantity of ships."""
    return Range(Bound(low, high, why), Bound(far_low, far_high, why))


def least(value: float, why: str) -> Bound:
    """No less than a value."""
    return Bound(value, _INF, why)


def most(value: float, why: str) -> Bound:
    """No more than a value."""
    return Bound(-_INF, value, why)


# Resistance and damping
COASTING = 0.01
RESISTANCE = least(COASTING, "coasting, a ship loses half of its speed within 70 lengths: ln 2/0.01")
GROWTH = Bound(0.5, 5.0, "linear at creeping speed, square of it from friction, up to the fourth power from waves")
ASTERN = Bound(0.2, 8.0, "a hull astern has up to some times the resistance that it has ahead")
UNDER_WAY = least(1e-3, "at held revolutions a faster ship has less thrust and more resistance")
SWAY = least(
    0.03, "a tenth of what the lift of a plate as deep as a ship gives at small drift, pi d/(2 L) over its mass"
)
YAW = least(0.03, "a turning hull is damped: yaw fades by 50 to 200 % per length, here by a thirtieth of that")
TURNED = Bound(0.05, 0.95, "drift and yaw take 5 to 95 % of the speed in a hard turn, less in one of less drift")
HULL = least(1.0, "a hull always pushes against its own motion")
STILL = most(1e-9, "nothing moves by itself")
# Stability
WITH_SPEED = least(0.01, "roots scale with speed: at a quarter of it they move by more than 1 %")
BY_HULL = least(0.01, "half as much again of the strongest coefficient of the hull moves the root by 1 %")
PULLED_OUT = most(0.02, "a stable ship, its rudder amidships again, stops turning: below 0.02 U/L")
KEEPS_TURNING = least(0.005, "a turn that fades by 0.02 U/L leaves 0.0025 U/L after 300 L/U: twice that goes on")
NEARLY_OUT = most(0.2, "next to neutral, a pull-out may end in a slow turn, not in a hard one")
NEAR_NEUTRAL = 0.02
"""Growth of a disturbance [U/L] below which a pull-out of 300 L/U cannot tell stable from unstable."""
# No impossible motion
FASTEST = most(2.0, "no steady order makes a ship twice as fast as at its approach")
SPINNING = most(10.0, "one turn within two thirds of a length is the end of what floats")
NO_GAIN = most(1.0 + 1e-9, "nothing that is left alone gains motion")
ENERGY = most(0.0, "with the engines stopped kinetic energy only falls")
CENTRIFUGAL = Bound(0.1, 1.6, "(m + m_x - Y_r)/(m + m_y): a turning ship is thrown outwards, by about half of u r")
DRIFTING_TURN = Bound(0.5, 4.0, "(m + m_y + X_vr)/(m + m_x): drift in a turn acts on surge by once to twice v r")
SURGE_MASS = Bound(1.005, 1.6, "added mass in surge is 1 to 20 % of the displaced water")
SWAY_MASS = Bound(1.15, 4.0, "added mass in sway is 40 to 120 % of the displaced water")
GYRATION = Bound(
    0.255, 0.55, "radius of gyration in yaw with added inertia, over L: a quarter without, a third with it"
)
SYMMETRY = most(0.02, "a mass matrix is symmetric: pushing sways as it yaws")
MIRROR = most(0.4, "port and starboard differ by the swirl of a single propeller only")
SIDES = Bound(0.4, 2.5, "the same to both sides but for a single propeller")
INVARIANT = most(1e-6, "neither place nor heading matters in calm water")
CURRENT = most(1e-3, "uniform current moves the water: motion over ground is that in still water plus the drift")
# Rudder
OWN_SIDE = least(0.02, "tighter than a circle of 50 lengths radius, to the side of the rudder")
TIGHTER = least(1e-3, "more rudder, a tighter circle")
CIRCLE = Bound(
    0.1, 25.0, "ships turn in 2 to 6 lengths at the greatest angle, thrusters that turn about in a tenth of one"
)
STERN_OUT = Bound(-1.5, 0.02, "the force is at the stern: it pushes midship to the outside")
BOW_INSIDE = least(0.5, "bow inside the turn, by 5 to 20 deg at the greatest rudder")
PIVOT = least(-0.15, "a hull of positioning turns about its lateral resistance, within 0.15 L of midship")
DEAD_WATER = most(1e-3, "without inflow a rudder has no force, at rest and with the propeller stopped")
INFLOW = Bound(0.02, 0.15, "with the propeller stopped it goes with the square of speed: 1/16 at a quarter")
STEERS = least(1e-3, "a ship that coasts still steers, if weakly")
MORE_RACE = least(5e-3, "more revolutions, a faster race and more force: 1.3 times give at least 0.5 %")
KICK = least(1e-3, "at rest, the race of the propeller alone gives the rudder a moment")
ASTERN_RUDDER = most(
    0.02, "with sternway and a stopped propeller the inflow comes from behind: force to the other side"
)
NOTICEABLE = least(0.01, "a change that a pilot can see")
ANSWERED = least(2.0, "a ship that can be steered reverses twice within 60 lengths; the slowest tankers need 20")
OVERSHOOT = most(80.0, "the most unstable tankers overshoot by some 40 deg, response models of them by 66")
USUAL_OVERSHOOT = most(35.0, "IMO's criterion is 25 deg; ships that miss it reach some 35")
USUAL_OVERSHOOT_OF_RESPONSE = most(60.0, "nothing slows a response model in a turn: it overshoots by half as much more")
DEAD_TIME = most(0.5, "a steering gear begins to move within seconds, much before the ship has moved by its length")
LAG = most(1.5, "a steering gear, or a thruster that steers, has followed before the ship has moved by two lengths")
QUICK = within(
    0.0, 40.0, 0.0, 200.0, "motions of ships die out within a third of a length to some lengths, few in a tenth"
)
AT_FIRST = within(
    0.08, 1.0, 0.03, 3.0,
    "heading after one length over the rudder angle: at least 0.3 of ships that handle well, 0.2 of large tankers "
    "(Norrbin 1960), half of that of models without the rudder's kick; 0.1 to 0.6 of the library",
)  # fmt: skip
# Against regressions
FAR_FROM_USUAL = Bound(-5.0, 5.0, "published sets lie within 3 sigma of the formulas, one number within 5")
USUAL = Bound(-3.5, 3.5, "published sets lie within 3 sigma of the formulas, one number within 5")
# The whole ship: forces over m U^2/L, moments over m U^2.  Ranges are those of the ships with rudders in the library
# (1.2 m to 320 m, tankers to container ships), widened by the scatter of coefficients between towing tanks, some 25 %.
_ADDED = "added masses of ships: 2 to 15 % in surge, 55 to 120 % in sway (Clarke et al. 1983; Motora 1959)"
_CRAFT = "small and broad craft have less: 0 to 40 % in surge, 0 to 150 % in sway, identified to 10 %"
MASSES = (
    within(1.005, 1.3, 1.0, 1.7, _ADDED), within(1.35, 2.4, 1.1, 3.5, _ADDED),
    within(0.28, 0.4, 0.22, 0.55, "0.24 to 0.27 L of the mass, with the added inertia 0.32 to 0.36 L"),
)  # fmt: skip
MASSES_OF_CRAFT = (
    within(0.999, 1.45, 0.7, 2.0, _CRAFT), within(0.9, 2.6, 0.7, 4.0, _CRAFT),
    within(0.19, 0.43, 0.13, 0.6, "an even plate has 0.29; craft, with added inertia, 0.25 to 0.36"),
)  # fmt: skip
MASS_LEVER = within(-0.06, 0.06, -0.2, 0.2, "the centre of gravity lies within 4 % of the length of midship")
FULLNESS = within(3.0, 11.0, 2.0, 16.0, "length over the cube root of the volume: 3 to 4.5 of tugs, 5 to 9 of ships")
BREADTH = within(1.8, 8.0, 1.2, 15.0, "breadth over draught: 2 to 5 of ships, more of inland ships in ballast")
LONGEST = within(0.2, 400.0, 0.1, 450.0, "the longest ships have some 400 m, the longest that was 440 m")
LENGTH = within(1.7, 11.0, 1.2, 16.0, "length over breadth: 2.5 to 4 of tugs, 5 to 9 of ships")
BLOCK = within(0.34, 0.9, 0.2, 1.0, "block coefficient: 0.4 of fast craft to 0.88 of bulkers")
BLOCK_OF_CRAFT = within(0.12, 0.9, 0.05, 1.0, "two slender hulls fill a fifth of the box about them")
SURGE_SLOPE = within(0.04, 0.8, 0.01, 2.0, "time in which a disturbance of speed dies out: 2 to 25 lengths")
RESISTANCE_OF_SHIPS = within(0.75, 6.0, 0.4, 12.0, "total resistance is 1.1 to 4 times the friction (Holtrop 1984)")
RESISTANCE_OF_CRAFT = within(0.5, 150.0, 0.2, 400.0, "small craft, catamarans and models of positioning have more drag")
SHARED = within(0.08, 0.6, 0.04, 1.0, "strips of drag have 1/8, strips of lift 1/6, a rudder at the stern adds")
SHARED_OF_CRAFT = within(
    0.02, 2.0, 0.005, 3.0, "strips of drag have 1/8, strips of lift 1/6, ends at stern and bow add"
)
SIDEWAYS = within(0.65, 300.0, 0.4, 1e4, "drag sideways over ahead: 1 to 20 of small craft, 45 to 120 of ships")
_CLARKE = "Clarke, Gedling and Hine (1983), hull with rudder: 0.65 to 1.8 times on 14 ships"
CLARKE = {
    "Y_v": within(0.55, 2.2, 0.35, 3.5, _CLARKE), "N_v": within(0.45, 1.7, 0.2, 2.5, _CLARKE),
    "N_r": within(0.58, 2.2, 0.35, 3.5, _CLARKE), "Y_r": within(0.15, 0.85, -0.2, 1.1, "0.24 to 0.65 on 14 ships"),
}  # fmt: skip
_RUDDERS = (
    "A_R f_alpha (u_R/U)^2 (1 + a_H)/(2 C_b B d): from L d/70, 2.4 and 0.75 of the tanker with the least rudder on; "
    "0.16 to 0.5 and, as a moment, 0.08 to 0.24 on 14 ships"
)
HELM_SWAY = within(-0.65, -0.08, -1.2, -0.04, _RUDDERS)
HELM_YAW = within(0.04, 0.32, 0.02, 0.6, _RUDDERS)
HELM_LEVER = within(
    -0.6, -0.4, -0.7, -0.3, "the rudder stands at the stern, its force on the hull a little ahead of it"
)
HELM_DRAG = within(
    0.15, 0.75, 0.0, 1.2, "(1 - t_R) tan(delta)/(1 + a_H) of a normal force: 0.24 to 0.64 on 14 ships"
)
_TURNING = "in a hard turn; on 14 ships, hull, propeller and rudder together"
LARGE = {
    "Y_vvv": within(0.9, 2.7, 0.5, 4.5, _TURNING), "Y_vrr": within(-0.02, 1.8, -0.3, 3.5, _TURNING),
    "N_rrr": within(0.93, 1.5, 0.6, 2.5, _TURNING), "N_vvr": within(-0.02, 5.0, -0.3, 9.0, _TURNING),
    "N_vvv": within(-0.25, 0.22, -0.5, 0.4, _TURNING), "N_vrr": within(-0.5, 0.2, -0.8, 0.4, _TURNING),
    "Y_rrr": within(-0.15, 0.14, -0.4, 0.4, _TURNING), "Y_vvr": within(-0.45, 2.0, -1.0, 3.0, _TURNING),
    "X_vr": within(-0.3, 1.75, -1.2, 3.0, "1 in potential flow, of which viscosity leaves 0.3 to 1 (Hasegawa 1980); "
                   "-0.06 to 1.46 on 14 ships"),
    "X_vv": within(-1.4, 0.5, -2.5, 1.5, _TURNING),
    "X_rr": within(-0.25, 0.45, -0.6, 0.8, _TURNING),
}  # fmt: skip
RUDDER_AREA = within(0.007, 0.05, 0.004, 0.1, "rudders have 1/70 to 1/25 of L d; of pairs, each")
RUDDER_HEIGHT = within(0.35, 1.3, 0.15, 2.5, "rudders are as high as 0.5 to 0.9 of the draught, in ballast to 1.2")
PROPELLER = within(0.2, 1.0, 0.12, 1.3, "propellers have 0.3 to 0.8 of the draught, of planing craft more")
WAKE = within(-0.05, 0.5, -0.25, 0.8, "wake fraction of ships: 0.5 C_b - 0.05 (Taylor), 0 to 0.15 of two screws")
WAKE_OF_MODEL = within(-0.05, 0.7, -0.25, 0.9, "of models up to 0.6: the wake grows with friction (ITTC 1978)")
DEDUCTION = within(0.0, 0.33, -0.15, 0.6, "thrust deduction: 0.1 to 0.3 (Holtrop 1984), a tuned set 0.04")
USUAL_BLOCK = within(
    0.55, 1.2, 0.45, 1.6, "block coefficient over 0.7 + 0.125 atan((23 - 100 F_n)/4), Watson and Gilfillan (1977)"
)
# Roll
ROLL_STIFFNESS = within(
    0.05, 1.6, 0.015, 6.0, "square of the roll frequency over g/B: GM/B of 0.01 to 0.2, radius of gyration 0.4 B"
)
ROLL_DAMPING = within(0.01, 0.7, 0.002, 1.2, "roll dies out in some periods: 1 to 30 % of the critical damping")
KEEL = within(0.05, 1.2, -0.3, 2.5, "the hull's side force acts at about half of its depth: 0.5 to 0.6 of the draught")
HEEL = within(0.2, 25.0, 0.02, 45.0, "in a hard turn a ship heels outwards by 1 to 20 deg")
# Propeller
ADVANCE = within(0.3, 1.3, 0.15, 2.0, "speed over n D: 0.4 of tankers to 1.1 of fast ships")
BALANCE = within(-0.5, 0.6, -0.8, 2.0, "thrust over resistance, less one; a published set leaves 0.43")
PULL_OVER_THRUST = within(1.02, 5.0, 1.0, 12.0, "standing, a propeller thrusts 1.2 to 3 times as at its speed")
PULL_NUMBER = within(0.12, 0.7, 0.06, 1.2, "bollard K_T of propellers is 0.2 to 0.6, thrust deduction taken off")
SWING_SHARE = within(0.0, 0.35, 0.0, 0.7, "side force of a reversed propeller: 5 to 25 % of its pull")
SWING_LEVER = within(-0.65, -0.25, -0.9, -0.1, "the side force of a reversed propeller acts at the stern")
PUSH = least(1e-4, "more revolutions, more thrust")
FADES = most(1e-6, "at held revolutions a faster inflow takes thrust; one that is ordered in newtons stays")
SQUARE_THRUST = Bound(1.5, 6.0, "bollard pull goes with the square of revolutions, or with ordered thrust")
FOLLOWS = least(0.01, "more revolutions, more speed")
HALF = Bound(0.2, 0.8, "half the revolutions hold about half the speed")
PULLS_ASTERN = least(1e-4, "reversed revolutions pull astern")
REVERSED = Bound(0.15, 1.3, "reversed, a propeller has 40 to 100 % of its bollard pull")
STERNWAY = Bound(0.1, 1.3, "astern the ship reaches a good part of its speed ahead")
STOPPING = Bound(0.2, 40.0, "a crash stop takes 2 to 20 lengths")
SWING = least(1e-3, "the wheel effect of a single reversed propeller")
HANDED = least(
    0.0, "a right-handed propeller swings the stern to port when it is reversed, a left-handed one to starboard"
)
NO_SWING = most(1e-6, "side forces of a contra-turning pair cancel")
# Thrusters
LOSS = most(0.95, "flow along the hull bends the jet: at half speed some of the force is gone")
FALLS = least(1e-4, "the faster the ship, the less is left")
KEPT = Bound(0.0, 1.0, "under way a thruster pushes to the same side as at rest, not more than there")
THRUST_SQUARE = Bound(2.5, 6.0, "thrust goes with the square of revolutions")
THRUSTER_LEVER = most(0.62, "a thruster stands within the hull")
NAMED_PLACE = least(0.0, "what is called bow stands ahead of midship, stern abaft it")
THRUSTER_FORCE = within(
    5e-5, 0.4, 1e-6, 0.8, "thrust over weight: 0.02 to 0.1 % of tunnels, some % of azimuths, a third of a light USV's"
)
DIRECTED = most(0.02, "a thrust points where its angle says")
# Wind and waves
WIND_ACROSS = within(0.45, 1.35, 0.25, 2.0, "beam force over q A_L: 0.7 to 1.05 (Blendermann 1994; Isherwood 1972)")
WIND_ALONG = within(0.25, 1.3, 0.1, 2.0, "head force over q A_T: 0.45 to 1.0 (Blendermann 1994; Isherwood 1972)")
AREA_ACROSS = within(0.018, 0.16, 0.008, 0.2, "lateral area over L^2: 0.03 of loaded tankers to 0.13 of car carriers")
AREA_ALONG = within(0.12, 0.7, 0.05, 1.0, "frontal over lateral area: 0.15 to 0.5")
AREA_HEAD = within(0.2, 2.2, 0.1, 4.0, "frontal area over B^2: 0.4 to 1.5")
OUTLINE = within(
    -0.13, 0.13, -0.25, 0.25, "a house with a third of the lateral area at the end of the hull moves its centre so far"
)
PRESSURE_PLACE = within(
    -0.22, 0.22, -0.3, 0.3, "of one loaded tanker 0.05 L by Blendermann (1994), 0.21 L by Fujiwara et al. (1998)"
)
WAVE_DRIFT = within(0.2, 1.6, 0.02, 3.0, "beam drift over rho g L H_S^2/16, what a wall reflects, in short waves")
LEEWARD = least(0.05, "wind pushes to leeward from every direction")
LEEWARD_SURGE = least(0.0, "head wind slows a ship at any speed, tail wind does not")
WAVE_LEEWARD = least(-0.02, "mean drift force of waves is to leeward, next to nothing from astern")
APPARENT = least(1.5, "the apparent wind of three times the speed is 4 U from ahead, 2 U from astern")
WIND_SQUARE = Bound(3.6, 4.4, "force goes with the square of wind speed: four times at twice")
LEEWAY = Bound(0.002, 0.3, "adrift in a beam wind, a ship makes 1 to 10 % of the wind speed")
HEAD_WIND = least(0.02, "head and tail wind act along the ship: at least a fiftieth of the beam force")
WIND_LEVER = Bound(0.005, 0.52, "the centre of wind pressure lies off midship, within the length over all")
LEVER_TRAVELS = least(0.0, "the centre of pressure moves aft as the wind does")
WIND_MIRROR = most(0.1, "wind from port is the mirror image of wind from starboard")
WIND_JUMP = most(0.25, "force changes smoothly with the angle: over 5 deg by less than a quarter of its greatest")
SEEN_FROM_SHIP = most(1e-6, "only the angle between wind or waves and the ship matters, not the heading")
WAVE_SQUARE = Bound(3.0, 5.0, "drift force goes with the square of wave height")
SEED = most(0.0, "one seed, one wind")
GUSTING = least(1e-3, "another seed, another wind")
# Actuators
LATE = Bound(0.8, 1.25, "an order is carried out in the time that rate, lag and dead time of its file give")
WAITS = least(1e-9, "some time passes between an order of the rudder and its angle")
ALL_WAIT = least(1.0, "the steering gear is among those that take time")
SAME_GEAR = most(1e-6, "the ship moves by its actuators' values")
SOME = Bound(1e-9, 1e12, "a finite value above zero")
STROKE = Bound(0.02, 3.0, "from midships to hard over within three lengths, not within a fiftieth of one")
SOLAS = math.radians(65.0 / 28.0)
"""Least rate of a steering gear, from 35 deg to 30 deg of the other side in 28 s (SOLAS II-1/29) [rad/s]."""
REACHED = Bound(0.99, 1.001, "an order beyond the limit ends at the limit")
RATE = Bound(0.9, 1.01, "the greatest rate is that of the file")
ANGLE = Bound(10.0, 90.0, "rudders reach 35 deg, some 90 deg")
# Interfaces and equations
SENTENCES = least(8.0, "heading, rate of turn, speed, position, course, time, rudder and wind")
LAST_DIGIT = most(1.5, "a sentence is rounded, and up to one tick old")
ALL_OPEN = least(1.0, "all of it")
OBEYED = most(0.06, "an order in force to the digits of its sentence")
SAME_EQUATIONS = most(1e-9, "one set of equations, whoever evaluates it")
READABLE = most(3000.0, "some days of a test house to read and check")
# Computation
STIFF = most(1.0, "RK4 is accurate to a step of some half of the fastest time constant, stable to 2.8 of it")
OWN_STEP = Bound(1.0 - 1e-9, 1.0 + 1e-9, "a model in discrete time has one step")
STEP_ERROR = most(1e-3, "a track that a plot cannot tell from the exact one")
REAL_TIME = least(1.0, "faster than the clock")
# Rest
LEFT = most(1.0, "a hull with the least resistance, u' = -0.01 u |u|/L, leaves no more")
FELL = least(1e-6, "motion falls until the end")
