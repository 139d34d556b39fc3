"""What `simulate` says of a run that ends before the manoeuvre does."""

from __future__ import annotations

import json

import pytest

from seatrial.cli.app import main


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict]:
    """Exit status and JSON of `simulate`."""
    status = main(["simulate", *arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.slow
def test_a_straight_run_that_the_wind_ends_early_is_not_complete(capsys) -> None:
    status, said = told(capsys, "esso_osaka_3m", "straight", "--wind", "15,90", "--duration", "300")
    assert (status, said["complete"]) == (1, False)
    assert "[validity]" in said["reason"]
    assert said["time"] == said["settings"]["duration"] < 10.0


@pytest.mark.slow
def test_a_manoeuvre_that_is_not_over_fails_and_a_timed_one_is_whole_at_any_length(capsys) -> None:
    status, said = told(capsys, "kvlcc2_l7", "zigzag", "--duration", "20")
    assert (status, said["complete"], said["time"]) == (1, False, pytest.approx(20.0))
    assert "not over" in said["reason"]
    status, said = told(capsys, "kvlcc2_l7", "straight", "--duration", "20")
    assert (status, said["complete"], said["reason"]) == (0, True, None)
    status, said = told(capsys, "kvlcc2_l7", "random", "--duration", "20")
    assert (status, said["complete"]) == (0, True)


@pytest.mark.parametrize("number", ["1e300", "-1e300", "inf", "nan", "5e-324"])
def test_a_number_that_no_ship_knows_is_refused_in_a_line(number: str, capsys) -> None:
    for option in ("--rps", "--speed", "--duration", "--dt", "--depth", "--rudder"):
        assert main(["simulate", "kvlcc2_l7", "turning", f"{option}={number}"]) == 2, option
        assert capsys.readouterr().err.startswith(f"error: {option} is ")
    for option, text in (("--wind", f"{number},90"), ("--current", f"{number},0"), ("--waves", f"{number},9,0")):
        assert main(["simulate", "kvlcc2_l7", "turning", f"{option}={text}"]) == 2, option
        assert capsys.readouterr().err.startswith(f"error: {option} is ")
