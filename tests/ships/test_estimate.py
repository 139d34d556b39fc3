"""Ships from particulars: formulas against published numbers, ranges said, bad files refused in one line."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from seatrial.cli.ships import estimate as command
from seatrial.core.parameters import values
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship, ShipError, shortened
from seatrial.ships.estimate import FORMULAS, SCATTER, SHARED, Estimate, Number, estimate
from seatrial.ships.files import load, save
from seatrial.ships.formulas import Particulars, added_mass, hull, propeller, resistance, rudder
from seatrial.ships.formulas.reading import read_particulars
from seatrial.simulate.run import approach, simulate
from seatrial.workflow import RequestError
from tiers import slow_but

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "particulars"
GOLDEN: dict[str, Any] = tomllib.loads((ROOT / "tests/golden/regression.toml").read_text(encoding="utf-8"))
CHECK = GOLDEN["check"]
NAMES = ("kvlcc2", "kcs", "esso_osaka_3m")
BARE = """schema = "seatrial-particulars/1"
[particulars]
L_pp = 150.0
B = 25.0
d = 9.0
C_b = 0.7
"""

every_ship = pytest.mark.parametrize("name", NAMES)


def particulars(name: str) -> Particulars:
    return read_particulars(EXAMPLES / f"{name}.toml").ship


def written(folder: Path, text: str) -> Path:
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def by_path(made: Estimate) -> dict[str, Number]:
    return {item.path: item for item in made.numbers}


def rounded(value: float, printed: float) -> bool:
    """Whether `value` agrees with every digit of `printed`."""
    digits = len(repr(printed).partition(".")[2])
    return abs(value - printed) <= 0.5 * 10**-digits * (1 + 1e-9)


class TestPublishedChecks:
    def test_added_masses_of_kvlcc2_kcs_and_suzaku(self) -> None:
        def found(ship: Particulars) -> dict[str, float]:
            return added_mass.motora(replace(ship, volume=ship.C_b * ship.L_pp * ship.B * ship.d))

        kvlcc2, kcs = found(particulars("kvlcc2")), found(particulars("kcs"))
        suzaku = found(replace(particulars("kcs"), L_pp=83.0, B=13.5, d=3.8, C_b=0.737))
        assert rounded(kvlcc2["body.m_y"], CHECK["kvlcc2_m_y"])
        assert rounded(kvlcc2["body.J_z"], CHECK["kvlcc2_J_z"])
        assert rounded(kcs["body.m_y"], CHECK["kcs_m_y"])
        assert rounded(suzaku["body.m_y"], CHECK["suzaku_m_y"])
        assert rounded(suzaku["body.J_z"], CHECK["suzaku_J_z"])

    def test_yaw_inertia_of_the_esso_osaka_with_a_quarter_of_the_length(self) -> None:
        ship = particulars("esso_osaka_3m")
        assert rounded(0.25**2 * ship.m + added_mass.motora(ship)["body.J_z"], CHECK["esso_osaka_3m_yaw"])

    @pytest.mark.parametrize(("aspect", "f_alpha"), list(CHECK["fujii"].items()))
    def test_fujii(self, aspect: str, f_alpha: float) -> None:
        ship = replace(particulars("kcs"), aspect=float(aspect))
        assert rounded(rudder.fujii(ship)["rudder.f_alpha"], f_alpha)

    def test_inoue_on_the_ship_of_marsim_2003(self) -> None:
        ship = replace(particulars("kcs"), L_pp=2.0, d=0.23)
        found = hull.inoue(ship)
        assert rounded(found["hull.Y_r"], CHECK["inoue"]["Y_r"])
        assert rounded(found["hull.N_r"], CHECK["inoue"]["N_r"])

    def test_hasegawa_on_the_ship_of_marsim_2003(self) -> None:
        m_y, C_m, X_vr = (CHECK["hasegawa"][key] for key in ("m_y", "C_m", "X_vr"))
        ship = replace(particulars("kcs"), C_b=(C_m + 0.432) / 1.66)
        own = added_mass.motora(ship)["body.m_y"]
        assert rounded(hull.hasegawa(ship)["hull.X_vr"] * m_y / own, X_vr)

    def test_fujiwara_on_the_esso_osaka_to_four_digits(self) -> None:
        found = by_path(estimate(EXAMPLES / "esso_osaka_3m.toml"))
        for name, printed in CHECK["fujiwara_esso_osaka_3m"].items():
            assert rounded(found[f"wind.{name}"].value, printed)

    def test_form_factor_of_two_ships(self) -> None:
        base = replace(particulars("kcs"), x_G=0.0, C_m=1.0)
        first = replace(base, L_pp=218.75, B=32.25, d=13.57, volume=80097.0, C_b=0.81)
        second = replace(base, L_pp=209.25, B=32.20, d=11.49, volume=52382.04, C_b=0.67)
        found = [resistance.form_factor(first), resistance.form_factor(second)]
        assert found == pytest.approx(CHECK["form_factor"], abs=1e-6)

    def test_signs_that_public_codes_have_wrong_agree_with_the_published_ships(self) -> None:
        for name in ("kvlcc2", "kcs"):
            ship, printed = particulars(name), GOLDEN[name]["hull"]
            found = hull.yoshimura(ship)
            assert found["hull.Y_vvv"] == pytest.approx(printed["Y_vvv"], rel=0.1)
            assert found["hull.N_vrr"] * printed["N_vrr"] > 0
            assert abs(found["hull.X_vr"] - printed["X_vr"]) < 0.03
            assert hull.inoue(ship)["hull.N_r"] == pytest.approx(printed["N_r"], rel=0.12)

    def test_linear_formulas_come_within_a_third_of_the_published_ships(self) -> None:
        for name in NAMES:
            ship, printed = particulars(name), GOLDEN[name]["hull"]
            for gives in (hull.yoshimura_linear, hull.inoue, hull.kijima, hull.clarke):
                found = gives(ship)
                for key in ("Y_v", "N_v", "N_r"):
                    assert found[f"hull.{key}"] == pytest.approx(printed[key], rel=0.34)


class TestPropeller:
    @every_ship
    def test_the_b_series_is_near_the_published_curve_at_bollard_pull(self, name: str) -> None:
        assert propeller.b_series(particulars(name))["propeller.k_0"] == pytest.approx(
            GOLDEN[name]["propeller"]["k_0"], rel=0.1
        )

    def test_the_parabola_follows_the_polynomial(self) -> None:
        ship = particulars("kvlcc2")
        k = propeller.b_series(ship)
        for J in (0.0, 0.2, 0.4, 0.6):
            fit = k["propeller.k_0"] + k["propeller.k_1"] * J + k["propeller.k_2"] * J * J
            exact = propeller.thrust_coefficient(J, ship.pitch_ratio, ship.area_ratio, ship.blades)
            assert fit == pytest.approx(exact, abs=0.005)

    def test_thrust_ends_a_little_above_the_pitch(self) -> None:
        assert propeller.thrust_coefficient(1.0, 1.0, 0.55, 4) > 0 > propeller.thrust_coefficient(1.2, 1.0, 0.55, 4)


class TestHoltrop:
    """Holtrop 1984 for a single screw and a normal stern, written out a second time from its printed equations."""

    @pytest.mark.parametrize("ship", [
        {"C_b": 0.81, "C_m": 0.998, "B": 58.0, "d": 20.8, "D_P": 9.86},
        {"C_b": 0.55, "C_m": 0.98, "B": 40.0, "d": 7.0, "D_P": 3.0},
        {"C_b": 0.651, "C_m": 0.985, "B": 32.2, "d": 10.8, "D_P": 7.9, "x_G": -3.4},
    ], ids=["full", "broad, shallow, small screw", "fine"])  # fmt: skip
    def test_wake_and_thrust_deduction(self, ship: dict[str, float]) -> None:
        own = replace(particulars("kcs"), L_pp=230.0, **{"x_G": 0.0, **ship})
        own = replace(own, volume=own.C_b * own.L_pp * own.B * own.d)
        L, B, T, D = own.L_pp, own.B, own.d, own.D_P
        C_P, lcb = own.C_b / own.C_m, 100.0 * own.x_G / L
        S, C_V = resistance.wetted_surface(own), resistance.viscous(own)
        c8 = B * S / (L * D * T) if B / T < 5 else S * (7 * B / T - 25) / (L * D * (B / T - 3))
        c9 = c8 if c8 < 28 else 32 - 16 / (c8 - 24)
        c11 = T / D if T / D < 2 else 0.0833333 * (T / D) ** 3 + 1.33333
        if C_P < 0.7:
            c19 = 0.12997 / (0.95 - own.C_b) - 0.11056 / (0.95 - C_P)
        else:
            c19 = 0.18567 / (1.3571 - own.C_m) - 0.71276 + 0.38648 * C_P
        C_P1 = 1.45 * C_P - 0.315 - 0.0225 * lcb
        w = c9 * C_V * (L / T) * (0.050776 + 0.93405 * c11 * C_V / (1 - C_P1))
        w += 0.27915 * math.sqrt(B / (L * (1 - C_P1))) + c19
        assert resistance.wake(own)["propeller.w_P0"] == pytest.approx(w, rel=1e-9)
        t = 0.25014 * (B / L) ** 0.28956 * (math.sqrt(B * T) / D) ** 0.2624 / (1 - C_P + 0.0225 * lcb) ** 0.01762
        assert resistance.thrust_deduction(own)["propeller.t_P"] == pytest.approx(t, rel=1e-9)

    def test_friction_of_ittc_1957_and_the_allowance_of_a_ship(self) -> None:
        ship = replace(particulars("kcs"), L_pp=200.0, d=10.0, nu=1e-6, speed=5.0)
        ship = replace(ship, volume=ship.C_b * ship.L_pp * ship.B * ship.d)
        assert ship.d / ship.L_pp > 0.04
        C_F, C_A = 0.075 / (9.0 - 2.0) ** 2, 0.006 * 300.0**-0.16 - 0.00205
        assert resistance.viscous(ship) == pytest.approx(resistance.form_factor(ship) * C_F + C_A, rel=1e-9)
        light = replace(ship, d=5.0, volume=0.5 * ship.volume)
        C_A += 0.003 * math.sqrt(200.0 / 7.5) * light.C_b**4 * (0.04 - 0.025)
        assert resistance.viscous(light) == pytest.approx(resistance.form_factor(light) * C_F + C_A, rel=1e-9)


@every_ship
def test_an_estimate_holds_for_as_much_drift_and_turn_to_either_side(name: str) -> None:
    ship = estimate(EXAMPLES / f"{name}.toml").ship
    pace = ship.speed / ship.L_pp
    assert ship.validity["r"] == pytest.approx((-pace, pace))
    assert ship.validity["v_m"] == pytest.approx((-0.5 * ship.speed, 0.5 * ship.speed))
    low, high = ship.validity["delta"]
    assert low == -high
    assert ship.validity["u"] == pytest.approx((0.0, 1.2 * ship.speed))


class TestUncertainty:
    def test_scatter_is_the_rms_difference_from_four_published_ships(self) -> None:
        errors: dict[str, list[float]] = {}
        for name in (*NAMES, "suzaku"):
            for path, error in differences(name):
                errors.setdefault(BOTH.get(path, path), []).append(error)
        found = {path: math.sqrt(sum(e * e for e in es) / len(es)) for path, es in errors.items()}
        assert {BOTH.get(path, path) for path in SCATTER} == set(found)
        for path, value in SCATTER.items():
            assert value == pytest.approx(found[BOTH.get(path, path)], rel=6e-3), path

    def test_sigma_is_the_larger_of_spread_and_scatter(self) -> None:
        for item in by_path(estimate(EXAMPLES / "kvlcc2.toml")).values():
            if item.formula not in ("given", "assumed"):
                scatter = SCATTER.get(item.path)
                if scatter is not None and item.path in SHARED:
                    scatter *= abs(item.value)
                known = [x for x in (item.spread, scatter) if x is not None]
                if known and "assumed particulars" not in item.sigma_from:
                    assert item.sigma == max(known)
                    assert not item.sigma_from.startswith("assumed")

    def test_an_assumed_pitch_adds_what_it_moves_the_propeller_by(self, tmp_path: Path) -> None:
        """A fifth of the assumed .8, through the B-series, beside the scatter of the series; nothing if given."""
        k_0 = [propeller.b_series(read_particulars(written(tmp_path, BARE + f"pitch_ratio = {pitch}\n")).ship)
               ["propeller.k_0"] for pitch in (0.8, 0.96)]  # fmt: skip
        open_, known = (by_path(estimate(written(tmp_path, BARE + more)))["propeller.k_0"].sigma
                        for more in ("", "pitch_ratio = 0.8\n"))  # fmt: skip
        assert known == SCATTER["propeller.k_0"]
        assert open_ == pytest.approx(math.hypot(known, k_0[1] - k_0[0]))

    def test_where_no_source_gives_a_scatter_sigma_is_a_stated_assumption(self) -> None:
        made = estimate(EXAMPLES / "kvlcc2.toml")
        numbers = by_path(made)
        for path, share in {"rudder.f_alpha": 0.1, "body.I_zG": 0.16, "propeller.C_1": 0.3}.items():
            assert numbers[path].share == pytest.approx(share)
            assert numbers[path].sigma_from.startswith("assumed") or path == "body.I_zG"
            assert f"sigma: assumed {share:.0%}" in made.ship.entries[path].source
        assert not [n.path for n in numbers.values() if n.formula not in ("given", "assumed") and n.sigma is None]
        assert numbers["body.L_pp"].share is None

    def test_spread_counts_equal_formulas_once(self) -> None:
        item = by_path(estimate(EXAMPLES / "kvlcc2.toml"))["hull.N_v"]
        assert set(item.others) == {"Inoue 1981", "Kijima 1990", "Clarke 1983"}
        assert item.spread == pytest.approx(abs(item.value - item.others["Clarke 1983"]) / math.sqrt(2))

    def test_sigma_of_the_file_is_in_the_unit_of_the_model(self) -> None:
        made = estimate(EXAMPLES / "kvlcc2.toml")
        item, entry = by_path(made)["body.m_y"], made.ship.entries["body.m_y"]
        assert entry.prime
        assert item.sigma is not None
        assert entry.sigma == pytest.approx(item.sigma * 0.5 * 1025.0 * 320.0**2 * 20.8)


BOTH = {"propeller.C_2n": "propeller.C_2p", "rudder.gamma_Rn": "rudder.gamma_Rp"}
"""Numbers of the port side, whose differences count with those of starboard."""


def published(name: str) -> Mapping[str, Any]:
    """Numbers as printed by part; of SUZAKU without its flapped rudder, whose numbers mean something else."""
    if name in GOLDEN:
        return GOLDEN[name]
    found: dict[str, dict[str, float]] = {}
    for path, entry in load(name).entries.items():
        part, _, key = path.partition(".")
        if part in ("body", "hull", "propeller"):
            found.setdefault(part, {})[key] = entry.given
    return found


def differences(name: str) -> Iterator[tuple[str, float]]:
    """Path and difference from the published number, for the formula that is used first; of R_0 over the value."""
    ship, seen, printed = particulars(name), set[str](), published(name)
    for formula in FORMULAS:
        for path, value in formula.gives(ship).items():
            part, _, key = path.partition(".")
            if path not in seen and path != "hull.R_0" and key in printed.get(part, {}):
                yield path, value - printed[part][key]
            seen.add(path)
    R_0 = printed["hull"].get("R_0")
    model = GOLDEN["model_scale"].get(name, {"L_pp": ship.L_pp, "speed": ship.speed, "R_0": R_0})
    k = model["L_pp"] / ship.L_pp
    small = ship if k == 1.0 else replace(
        ship, L_pp=model["L_pp"], B=k * ship.B, d=k * ship.d, volume=k**3 * ship.volume, x_G=k * ship.x_G,
        A_R=k * k * ship.A_R, speed=model["speed"], nu=1.14e-6,
    )  # fmt: skip
    yield "hull.R_0", 1.0 - model["R_0"] / resistance.resistance(small)["hull.R_0"]


class TestShip:
    @every_ship
    def test_is_complete_sourced_and_reads_back(self, name: str, tmp_path: Path) -> None:
        made = estimate(EXAMPLES / f"{name}.toml").ship
        back = load(save(made, tmp_path / "ship.toml"))
        assert values(back.model) == values(made.model)
        assert (back.speed, back.L_pp, back.name) == (made.speed, made.L_pp, made.name)
        assert back.notes["cautions"]
        for path in values(back.model):
            assert back.entries[path].source
            assert back.entries[path].source != "not given"
        assert float(back.actuators.of("delta").high) == pytest.approx(math.radians(35.0))  # type: ignore[attr-defined]

    @pytest.mark.parametrize("name", slow_but(NAMES, "kcs"))
    def test_turns_and_zigzags(self, name: str) -> None:
        ship = estimate(EXAMPLES / f"{name}.toml").ship
        _, n_P = approach(ship)
        duration = 50 * ship.L_pp / ship.speed
        turn = Turning(n_P, math.radians(35.0))
        run = simulate(ship, turn, duration=duration)
        assert turn.complete(run)
        found = turn.indices(run, ship.L_pp)
        assert 2.0 < float(found["advance"].over_L or 0) < 4.5
        assert 2.0 < float(found["tactical_diameter"].over_L or 0) < 5.0
        zigzag = Zigzag(n_P, math.radians(10.0), math.radians(10.0), 1.0)
        swung = simulate(ship, zigzag, duration=duration)
        overshoots = [i.value for key, i in zigzag.indices(swung, ship.L_pp).items() if "overshoot" in key]
        assert len(overshoots) >= 2
        assert all(math.radians(1.0) < x < math.radians(20.0) for x in overshoots)

    def test_four_numbers_are_enough(self, tmp_path: Path) -> None:
        made = estimate(written(tmp_path, BARE))
        assert made.ship.speed == pytest.approx((1.08 - 0.7) / 1.68 * math.sqrt(9.80665 * 150.0))
        assert any("assumed" in line and "D_P" in line for line in made.cautions)
        assert by_path(made)["propeller.D_P"].formula == "assumed"
        assert made.ship.entries["hull.Y_v"].source.startswith("estimated: ")

    def test_a_known_number_replaces_its_formula_and_the_formula_is_still_told(self, tmp_path: Path) -> None:
        given = '[given]\nhull.R_0 = { prime = 0.02, source = "tank" }\npropeller.w_P0 = 0.3\n'
        made = estimate(written(tmp_path, BARE + given))
        found = by_path(made)
        assert (found["hull.R_0"].value, found["hull.R_0"].formula) == (0.02, "given")
        assert "Holtrop-Mennen" in found["hull.R_0"].others
        assert made.ship.entries["hull.R_0"].source == "tank"
        assert found["rudder.epsilon"].value == pytest.approx(2.26 - 1.82 * 0.7)
        assert not any("approach speed only" in line for line in made.cautions)

    def test_without_a_shape_above_water_there_is_no_wind(self) -> None:
        ship: Ship = estimate(EXAMPLES / "kvlcc2.toml").ship
        assert getattr(ship.model, "wind", None) is None

    def test_out_of_range_is_said_in_the_table_the_cautions_and_the_source(self) -> None:
        made = estimate(EXAMPLES / "kvlcc2.toml")
        assert by_path(made)["hull.X_vv"].outside == ("C_b = 0.81, range 0.51 to 0.65",)
        assert by_path(made)["hull.Y_v"].outside == ()
        assert any("outside the range of Yoshimura-Masumoto 2012" in line for line in made.cautions)
        assert "OUTSIDE its range" in made.ship.entries["hull.X_vv"].source


BAD: tuple[tuple[Callable[[str], str], str], ...] = (
    (lambda t: t.replace("C_b = 0.7", "C_b = 1.1"), r"C_b: 1.1 .*outside the physical range .*block coefficient"),
    (lambda t: t.replace("L_pp = 150.0", "L_pp = -150.0"), r"L_pp: -150 m is outside"),
    (lambda t: t.replace("d = 9.0\n", ""), r"missing d$"),
    (lambda t: t + "bredth = 2.0\n", r"no number 'bredth'"),
    (lambda t: t + "speeed = 2.0\n", r"no number 'speeed'; near: speed"),
    (lambda t: t + "rpm = 100.0\n", r"no number .rpm.; write n_P"), (lambda t: t + "Draught = 1.0\n", r"write d$"),
    (lambda t: t + 'speed = { value = 5.0, unit = "furlong" }\n', r"unit 'furlong'"),
    (lambda t: t + "volume = 30000.0\n", r"volume makes a block coefficient"),
    (lambda t: t.replace("B = 25.0", "B = 100.0"), r"L_pp/B is 1.5; .*2 to 12"),
    (lambda t: t + "D_P = 12.0\n", r"D_P/d is 1.33"),
    (lambda t: t + "H_R = 12.0\n", r"H_R is 12 m, above the draught"),
    (lambda t: t + "[wind]\nA_T = 500.0\n", r"wind needs the shape above water: missing A_L, A_OD"),
    (lambda t: t + "[wind]\nA_F = 500.0\n", r"wind: no number 'A_F'"),
    (lambda t: t + "[given]\nhull.Y_w = -0.3\n", r"given: no number 'hull.Y_w'; near: .*hull.Y_v"),
    (lambda t: t + "[given]\nrudder.A_R = 20.0\n", r"A_R stands in \[particulars\]"),
    (lambda t: t + "[given]\npropeller.t_P = 3.0\n", r"given.propeller.t_P: 3 .*outside the physical range"),
    (lambda t: t + "[given]\npropeller.w_P0 = 1.5\n", r"given.propeller.w_P0: 1.5 .*outside"),
    (lambda t: t + "[particular]\n", r"no key 'particular'; near: particulars"),
    (lambda t: "name = 3\n" + t, r"name and title are texts"),
    (lambda t: "given = 3\n" + t, r"given is not a table"),
    (lambda t: t.replace("particulars/1", "particulars/9"), r"schema is 'seatrial-particulars/9'"),
    (lambda t: t + "= 3\n", r"cannot be read as TOML"),
    (lambda t: t + "[given]\npropeller.w_P0 = -0.4\n", r"gives rudder.epsilon = -0.288, .*impossible .*\[given\]"),
)


class TestBadFiles:
    @pytest.mark.parametrize(("spoil", "message"), BAD)
    def test_is_refused_in_one_line_and_nothing_written(
        self, spoil: Callable[[str], str], message: str, tmp_path: Path
    ) -> None:
        path, out = written(tmp_path, spoil(BARE)), tmp_path / "ship.toml"
        with pytest.raises(ShipError, match=message) as caught:
            command(path, out, json=False)
        assert "\n" not in str(caught.value)
        assert str(path) in str(caught.value)
        assert not out.exists()

    def test_a_missing_file_is_named(self, tmp_path: Path) -> None:
        with pytest.raises(ShipError, match=r"none\.toml: cannot be read"):
            estimate(tmp_path / "none.toml")


def test_cautions_of_ranges_stand_in_one_line_where_there_are_several() -> None:
    both = ("outside the range of A 1: b = 2, range 3 to 4: x.y", "other", "outside the range of C: d = 5: z")
    assert [*shortened(both)] == [
        "outside the range of 2 formulas (A 1, C); by how much: the sources in the ship file", "other"]  # fmt: skip
    assert [*shortened(both[:2])] == [*both[:2]]
    assert [*shortened(())] == []


class TestCommand:
    @pytest.mark.slow
    def test_writes_and_shows(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        command(EXAMPLES / "kcs.toml", tmp_path / "ship.toml", json=False)
        told = capsys.readouterr()
        assert "hull.Y_v" in told.out
        assert "Clarke 1983" in (tmp_path / "ship.toml").read_text(encoding="utf-8")  # beside what was taken
        assert "warning: outside the range of" in told.err
        assert load(tmp_path / "ship.toml").name == "kcs_estimated"

    def test_json_holds_every_number(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        command(EXAMPLES / "esso_osaka_3m.toml", tmp_path / "ship.toml", json=True)
        told = json.loads(capsys.readouterr().out)
        assert set(told["numbers"]) == set(values(load(tmp_path / "ship.toml").model))
        number = told["numbers"]["hull.X_vv"]
        assert number["in_range"] is False
        assert number["formula"] == "Yoshimura-Masumoto 2012"

    def test_output_must_be_a_ship_file_in_a_folder_and_not_the_particulars(self, tmp_path: Path) -> None:
        path = written(tmp_path, BARE)
        with pytest.raises(RequestError, match=r"ends in \.toml"):
            command(path, tmp_path / "ship.json", json=False)
        with pytest.raises(RequestError, match="no such folder"):
            command(path, tmp_path / "none" / "ship.toml", json=False)
        with pytest.raises(RequestError, match="is an input"):
            command(path, path, json=False)
        assert path.read_text(encoding="utf-8") == BARE
