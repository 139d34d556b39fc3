"""A run in waves: variance against the spectrum, a mean course that does not drift, and what the command refuses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.data import Trial
from seatrial.environment.sea import Sea
from seatrial.environment.sea.rao import Rao
from seatrial.environment.sea.spectra import Ittc, Jonswap
from seatrial.simulate.seaway import in_waves
from seatrial.workflow.asked import Around, InWaves, Orders, Span
from seatrial.workflow.simulation import simulate

G = 9.80665


def ship(zeta: float = 0.08, natural: float = 0.6) -> Rao:
    """Heave and pitch of a barge of 60 m, roll as an oscillator of one mode; every motion present, axes of a ship."""
    omega, chi = np.linspace(0.1, 4.0, 400), np.radians(np.arange(0.0, 360.0, 15.0))
    k, w = np.meshgrid(omega**2 / G, chi, indexing="ij")[0], omega[:, None]
    along = np.sinc(0.5 * 60.0 * k * np.cos(chi) / np.pi)
    roll = 1.0 / (1.0 - (w / natural) ** 2 + 2j * zeta * w / natural)
    R = np.stack([-1j * np.cos(chi) * along, -1j * np.sin(chi) * along, -along + 0j * w, 1j * k * np.sin(chi) * roll,
                  -1j * k * np.cos(chi) * along, 0.2 * k * np.sin(2.0 * chi) * along + 0j], axis=-1)  # fmt: skip
    return Rao.of(omega, chi, R)


def straight(psi: float = 0.3, U: float = 6.0, duration: float = 3600.0) -> Trial:
    t = np.arange(0.0, duration, 0.5)
    still = np.zeros_like(t)
    return Trial("straight", t, {"x": U * math.cos(psi) * t, "y": U * math.sin(psi) * t, "psi": psi + still,
                                 "u": U + still, "v_m": still, "r": still})  # fmt: skip


def integral(rao: Rao, spectrum: Ittc | Jonswap, chi: float, mode: int) -> float:
    """Variance by quadrature of S |R|^2 on the table's own frequencies, apart from any component."""
    column = int(np.argmin(np.abs(rao.chi - chi)))
    return float(np.trapezoid(spectrum.density(rao.omega) * np.abs(rao.R[:, column, mode]) ** 2, rao.omega))


@pytest.mark.slow
@pytest.mark.parametrize(("spectrum", "chi"), [(Jonswap(3.0, 9.0, 3.3), 60.0), (Ittc(3.0, 9.0), 135.0)])
def test_variance_of_an_hour_is_that_of_spectrum_and_operator(spectrum: Ittc | Jonswap, chi: float) -> None:
    """Heave, roll and pitch within 3 % of the mean over twelve seas; a single hour scatters as the sea itself does."""
    rao, psi = ship(), 0.3
    seas = [Sea(spectrum, psi + math.radians(chi) - math.pi, seed=seed) for seed in range(12)]
    runs = [in_waves(straight(psi), sea, rao) for sea in seas]
    for name, mode in (("z", 2), ("phi", 3), ("theta", 4)):
        found = float(np.mean([run[name].var() for run in runs]))
        assert found == pytest.approx(integral(rao, spectrum, math.radians(chi), mode), rel=0.03), name


@pytest.mark.slow
def test_the_mean_course_does_not_drift() -> None:
    run = straight(0.3)
    seen = in_waves(run, Sea(Jonswap(4.0, 10.0), 1.0, seed=3), ship())
    away = seen["psi"] - run["psi"]
    assert away.std() > math.radians(0.1)
    assert abs(np.polyfit(run.t, away, 1)[0]) * 3600.0 < 0.2 * away.std()
    assert abs(away.mean()) < 0.02 * away.std()
    for name in ("x", "y"):
        assert abs((seen[name] - run[name]).mean()) < 0.03


@pytest.mark.slow
def test_rates_are_those_of_the_motions() -> None:
    """Also in a turn, where omega_e t as a phase would be wrong by t times the change of omega_e."""
    t = np.arange(3000.0, 3300.0, 0.05)
    r, U = 0.01, 8.0
    psi = r * t
    run = Trial("turn", t, {"x": U / r * np.sin(psi), "y": -U / r * np.cos(psi), "psi": psi, "u": U + 0 * t,
                            "v_m": 0 * t, "r": r + 0 * t})  # fmt: skip
    seen = in_waves(run, Sea(Jonswap(4.0, 10.0), 0.0, seed=1), ship())
    for motion, rate in (("z", "w"), ("phi", "p"), ("theta", "q")):
        slope = np.gradient(seen[motion], t)
        assert np.std(slope[1:-1] - seen[rate][1:-1]) < 0.05 * seen[rate].std(), motion


@pytest.mark.slow
def test_long_waves_carry_the_ship_along() -> None:
    """Heave is the surface itself, upside down as z is, and the ship rolls with its slope."""
    sea = Sea(Ittc(2.0, 20.0), 0.5 * math.pi, seed=2)  # from the east, ship heads north
    seen = in_waves(straight(0.0, 0.0), sea, ship(natural=50.0))
    assert seen["z"] == pytest.approx(-seen["zeta"], abs=0.02)
    west, here = (sea.waves.elevation(seen.t, 0 * seen.t, y + 0 * seen.t) for y in (-0.1, 0.1))
    assert seen["phi"] == pytest.approx(-(here - west) / 0.2, abs=1e-3)  # surface higher to starboard: heel to port


@pytest.mark.slow
def test_calm_water_changes_nothing() -> None:
    run = straight()
    seen = in_waves(run, Sea(Ittc(0.0, 9.0)), ship())
    for name in run.channels:
        assert np.array_equal(seen[name], run[name]), name


@pytest.mark.slow
def test_a_model_that_heels_keeps_its_heel() -> None:
    run = straight().having(phi=np.full(7200, 0.1), p=np.zeros(7200))
    seen = in_waves(run, Sea(Ittc(2.0, 9.0), 1.0), ship())
    assert seen["phi"].mean() == pytest.approx(0.1, abs=1e-3)


@pytest.mark.slow
def test_a_mirrored_sea_mirrors_the_motions() -> None:
    """Sea from starboard or from port: sway, roll and yaw change sides, the others stay."""
    one = in_waves(straight(0.0), Sea(Ittc(2.0, 9.0), 0.8, seed=5), ship())
    two = in_waves(straight(0.0), Sea(Ittc(2.0, 9.0), -0.8, seed=5), ship())
    for name, sign in (("z", 1.0), ("theta", 1.0), ("phi", -1.0), ("psi", -1.0), ("y", -1.0)):
        assert one[name] == pytest.approx(sign * two[name], abs=1e-9), name


TABLE = "omega [rad/s],chi [deg],heave [m/m],heave_phase [deg],roll [deg/m],roll_phase [deg]\n" + "".join(
    f"{w},{chi},1,180,{1.5 if chi % 180 else 0},90\n" for chi in range(0, 181, 30) for w in (0.2, 0.6, 1.2, 2.4)
)


@pytest.fixture
def rao(tmp_path: Path) -> Path:
    path = tmp_path / "rao.csv"
    path.write_text(TABLE)
    return path


@pytest.mark.slow
def test_the_command_adds_motion_and_mean_drift(rao: Path) -> None:
    calm = simulate("kvlcc2", "straight", span=Span(400.0))
    ran = simulate("kvlcc2", "straight", span=Span(400.0), waves=InWaves("4,10,90", rao), orders=Orders(seed=3))
    assert ran.motions["heave"].expected == pytest.approx(1.0, rel=0.02)  # H_S / 4, as heave is the surface here
    assert ran.motions["heave"].found == pytest.approx(1.0, rel=0.2)
    assert ran.trial["H_S"][0] == pytest.approx(4.0, rel=0.005)
    assert ran.trial["psi_slow"][-1] != calm.trial["psi"][-1]  # the beam sea pushes
    assert not calm.motions


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"sea": "4,10,90"}, "go together"), ({"rao": "rao"}, "go together"),
        ({"sea": "4,10,90", "rao": "rao", "waves": "4,8,90"}, "mean drift already"),
        ({"sea": "4,10,90", "rao": "rao", "roll_damping": 0.1}, "include their damping"),
        ({"roll_damping": 0.1}, "go together"),
        ({"sea": "4,10,90", "rao": Path("none.csv")}, "no such file"),
    ],
)  # fmt: skip
def test_the_command_refuses(rao: Path, given: dict[str, object], said: str) -> None:
    own = {key: rao if value == "rao" else value for key, value in given.items()}
    around = Around(waves=own.pop("waves", None))  # type: ignore[arg-type]
    with pytest.raises(RequestError, match=said):
        simulate("kvlcc2", "straight", span=Span(60.0), around=around, waves=InWaves(**own))  # type: ignore[arg-type]
