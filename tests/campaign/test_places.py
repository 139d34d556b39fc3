"""A campaign in an object store: the bytes of a folder, and the same commands."""

from __future__ import annotations

import json
import math
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from seatrial.campaign import Campaign, CampaignError, Case, Tracks
from seatrial.campaign.folder import begin, open_folder, write_part
from seatrial.campaign.inputs import Input
from seatrial.campaign.places import Folder, place_of
from seatrial.campaign.running import Shard, run
from seatrial.campaign.tables import scan, scan_tracks, wrong_parts
from seatrial.cli.app import main
from seatrial.core.executors import threads
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

pytest.importorskip("fsspec")
URL = "memory://bucket/tracks/run"


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    ship, ten = load("kvlcc2_l7"), math.radians(10.0)
    case = Case("case", ship, Zigzag(11.85, ten, ten), ship.speed, 30.0, 0.1, "rk4")
    inputs = {"ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True), "U_C": Input("uniform", (0.0, 0.1))}
    return Campaign("test", (case,), 180, inputs, chunk=40, tracks=Tracks(7))


@pytest.fixture
def store() -> Any:
    """The file system of `memory://`, empty again after a test."""
    import fsspec

    system = fsspec.filesystem("memory")
    yield system
    if system.exists("/bucket"):
        system.rm("/bucket", recursive=True)


def computed(campaign: Campaign, where: Path | str, shard: str = "1/1") -> int:
    with threads(2) as pool:
        return run(campaign, where, pool=pool, shard=Shard.read(shard)).parts


@pytest.mark.slow
def test_a_store_holds_the_bytes_of_a_folder(campaign: Campaign, tmp_path: Path, store: Any) -> None:
    computed(campaign, tmp_path / "run")
    computed(campaign, URL, "1/2")
    assert open_folder(URL).missing == [1, 3]
    assert computed(campaign, URL) == 2
    held, here = open_folder(URL), open_folder(tmp_path / "run")
    assert held.digest() == here.digest()
    assert not list(wrong_parts(held))
    assert scan(held).collect().equals(scan(here).collect())
    few = pl.col("run").is_between(39, 41)
    assert scan_tracks(held).filter(few).select("t", "psi").collect().equals(
        scan_tracks(here).filter(few).select("t", "psi").collect())  # fmt: skip
    assert scan_tracks(held).head(50).collect().equals(scan_tracks(here).head(50).collect())
    assert not [name for name in store.find("/bucket") if ".tmp" in name]
    with pytest.raises(CampaignError, match="another campaign"):
        begin(replace(campaign, seed=2), URL)


@pytest.mark.slow
def test_a_store_that_fails_stops_the_run_and_it_goes_on(
    campaign: Campaign, store: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin(campaign, URL)
    put, written = type(store).pipe_file, 0

    def breaks(system: Any, path: str, value: bytes, **settings: Any) -> Any:
        nonlocal written
        written += 1
        if written == 4:
            raise OSError(110, "Connection timed out")
        return put(system, path, value, **settings)

    monkeypatch.setattr(type(store), "pipe_file", breaks)
    assert write_part(campaign, URL, 0) == 40
    with pytest.raises(OSError, match="timed out"):
        write_part(campaign, URL, 1)
    held = open_folder(URL)
    assert (held.there("tracks"), held.there(), held.missing[0]) == ([0, 1], [0], 1)
    computed(campaign, URL)
    assert not list(wrong_parts(held))


def test_other_objects_are_not_mixed_with(campaign: Campaign, store: Any) -> None:
    store.pipe_file("/bucket/tracks/run/thesis.tex", b"")
    with pytest.raises(CampaignError, match="not empty"):
        begin(campaign, URL)


def test_places_travel_to_workers(tmp_path: Path) -> None:
    for place in (place_of(URL), place_of(tmp_path)):
        assert pickle.loads(pickle.dumps(place)) == place
    assert place_of(f"file://{tmp_path}") == Folder(tmp_path) == place_of(str(tmp_path))


FILE = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 30
chunk = 16
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 60.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [9, 11], unit = "deg" }
[criteria]
first_overshoot = { at_most = 12.0, unit = "deg" }
"""


@pytest.mark.slow
def test_the_commands_take_a_url(tmp_path: Path, store: Any, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", URL]) == 0
    assert len(store.find("/bucket/tracks/run")) == 3
    assert main(["campaign", URL, "--merge"]) == 2
    assert "name a file of this machine with -o" in capsys.readouterr().err
    assert main(["campaign", URL, "--merge", "-o", str(tmp_path / "all.parquet")]) == 0
    assert pl.read_parquet(tmp_path / "all.parquet").height == 30
    assert main(["campaign", URL, "--report", "-o", str(tmp_path / "page.html")]) == 0
    assert URL in (tmp_path / "page.html").read_text()
    capsys.readouterr()
    assert main(["campaign", URL, "--verify", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["done"] == 2
    assert main(["simulate", "--from", URL, "12", "--json"]) == 0
    assert "first_overshoot" in json.loads(capsys.readouterr().out)["indices"]


def test_a_url_of_this_machine_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", f"file://{tmp_path}/run"]) == 0
    assert main(["campaign", str(tmp_path / "run"), "--verify"]) == 0


@pytest.mark.parametrize(("url", "said"), [("blah://bucket/run", "blah"), ("memory://none", "holds no campaign")])
def test_places_that_are_none(tmp_path: Path, capsys: pytest.CaptureFixture[str], url: str, said: str) -> None:
    assert main(["campaign", url, "--status"]) == 2
    (tmp_path / "campaign.toml").write_text(FILE)
    if url.startswith("blah"):
        assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", url]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert all(said in line for line in lines)
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", URL, "--rare", "first_overshoot"]) == 2


class NoCredentialsError(Exception):
    """As a package of a store has it: no OSError."""


@pytest.mark.parametrize("error", [
    NoCredentialsError("Unable to locate credentials\nsecond line"), PermissionError("Access Denied"),
    ConnectionError("Could not connect to the endpoint URL"), ValueError("Invalid bucket name"), KeyError("endpoint"),
    FileNotFoundError("The specified bucket does not exist"), RuntimeError(""),
], ids=lambda error: type(error).__name__)  # fmt: skip
def test_a_store_that_is_out_of_reach_is_told_in_one_line(
    error: Exception, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import fsspec
    from fsspec.spec import AbstractFileSystem

    class Broken(AbstractFileSystem):
        protocol, cachable = "broken", False

        def _refuse(self, *_: Any, **__: Any) -> Any:
            raise error

        ls = cat_file = pipe_file = find = exists = info = _refuse

    fsspec.register_implementation("broken", Broken, clobber=True)
    (tmp_path / "a.toml").write_text(
        'schema = "seatrial-campaign/1"\nships = ["kvlcc2_l7"]\nruns = 2\n'
        '[manoeuvre]\nkind = "zigzag"\nduration = 5.0\ndt = 0.1\n')  # fmt: skip
    url = "broken://bucket/run"
    for command in ((str(tmp_path / "a.toml"), "-o", url), (url, "--status"), (url, "--verify"), (url, "--report")):
        capsys.readouterr()
        assert main(["campaign", *command]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert url in line
        if command[0] != url:
            assert (str(error).strip("'").splitlines() or [type(error).__name__])[0] in line


@pytest.mark.parametrize("url", ["s3://", "memory:///", "gs://"])
def test_a_url_without_a_bucket_is_refused(url: str, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"names no bucket; write .*://BUCKET/NAME"):
        place_of(url)
