"""The folder of a campaign: the same bytes whatever computed them, nothing twice, nothing half-written."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from killed import CAMPAIGN

from seatrial.campaign import Campaign, CampaignError, Case
from seatrial.campaign.analysis import analyse
from seatrial.campaign.folder import Held, begin, open_folder, part_name, write_part
from seatrial.campaign.inputs import Input
from seatrial.campaign.running import Ran, Shard
from seatrial.campaign.running import run as run_in
from seatrial.campaign.tables import merge, scan, wrong_parts
from seatrial.cli.app import main
from seatrial.core.errors import RunError
from seatrial.core.executors import threads as pool_of
from seatrial.engine import EngineNotice
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load


def run(campaign: Campaign, folder: Path, *, shard: Shard | None = None, threads: int = 2) -> Ran:
    with pool_of(threads) as pool:
        return run_in(campaign, folder, pool=pool, shard=shard or Shard())


TEN = math.radians(10.0)


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    ship = load("kvlcc2_l7")
    case = Case("case", ship, Zigzag(11.85, TEN, TEN), ship.speed, 30.0, 0.1, "euler")
    other = replace(case, name="other", manoeuvre=Zigzag(11.85, 2 * TEN, TEN))
    inputs = {"ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True), "U_C": Input("uniform", (0.0, 0.1))}
    return Campaign("test", (case, other), 90, inputs, chunk=20)


@pytest.fixture(scope="module")
def whole(campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    run(campaign, folder, threads=1)
    return folder


@pytest.mark.slow
def test_shards_and_threads_change_no_byte(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    for shard in (Shard(2, 3), Shard(0, 3), Shard(1, 3)):
        run(campaign, tmp_path / "shards", shard=shard, threads=2)
    one, other = open_folder(whole), open_folder(tmp_path / "shards")
    assert one.digest() == other.digest()
    assert not list(wrong_parts(other))
    table = scan(other).collect()
    assert table["run"].to_list() == list(range(180))


@pytest.mark.slow
def test_the_size_of_parts_changes_no_number(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    run(replace(campaign, chunk=33), tmp_path / "other")
    assert scan(open_folder(tmp_path / "other")).collect().equals(scan(open_folder(whole)).collect())


@pytest.mark.slow
def test_what_is_there_is_not_computed_again(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    gone = folder / part_name(4)
    gone.unlink()
    times = {path: path.stat().st_mtime_ns for path in folder.rglob("*.parquet")}
    ran = run(campaign, folder)
    assert (ran.parts, ran.runs) == (1, 20 if gone.stem != "0000004" else 10)
    assert all(path.stat().st_mtime_ns == at for path, at in times.items())
    assert open_folder(folder).digest() == open_folder(whole).digest()


@pytest.mark.slow
def test_another_campaign_is_refused(campaign: Campaign, whole: Path) -> None:
    with pytest.raises(CampaignError, match="another campaign"):
        begin(replace(campaign, seed=2), whole)


def test_another_version_is_refused(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    with monkeypatch.context() as older:
        older.setattr("seatrial.campaign.folder.__version__", "9")
        begin(campaign, folder)
    with pytest.raises(CampaignError, match="begun with seatrial 9"):
        begin(campaign, folder)


@pytest.mark.parametrize(("was", "now"), [('"rows": ', '"rows": 1'), ('"seed": ', '"send": '), ('"seal"', '"seel"')])
def test_a_manifest_that_was_changed_is_refused(whole: Path, tmp_path: Path, was: str, now: str) -> None:
    """Whatever a key says now, each command answers in one line: the manifest is sealed as a whole."""
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    manifest = folder / "campaign.json"
    text = manifest.read_text()
    assert was in text
    manifest.write_text(text.replace(was, now, 1))
    with pytest.raises(CampaignError, match="was changed after it was written"):
        open_folder(folder)
    manifest.write_text("[" * 100_000)
    with pytest.raises(CampaignError, match=r"campaign\.json: cannot be read"):
        open_folder(folder)


@pytest.mark.slow
@pytest.mark.parametrize("work", [analyse, lambda held: merge(held, Path(held.folder).with_name("all.parquet"))])
def test_a_damaged_part_is_one_line(whole: Path, tmp_path: Path, work: Callable[[Held], object]) -> None:
    """Every part is cut short by a byte, then to its first ones; what is whole still reads."""
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    part = sorted(folder.glob("parts/*/*.parquet"))[0]
    content = part.read_bytes()
    for damaged in (content[:-1], content[:40], b"", content[:60] + b"\xff" * 40 + content[100:]):
        part.write_bytes(damaged)
        with pytest.raises(CampaignError, match=r"cannot be read.* --verify"):
            work(open_folder(folder))
    part.write_bytes(content)
    work(open_folder(folder))


def test_a_folder_with_other_files_is_refused(campaign: Campaign, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(CampaignError, match="not empty"):
        begin(campaign, tmp_path)


def test_a_campaign_larger_than_the_disk_is_refused(campaign: Campaign, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="GB free"):
        begin(replace(campaign, runs=10**13, chunk=10**9), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_part_that_cannot_be_written_leaves_nothing(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    begin(campaign, folder)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_part(campaign, folder, 0)
    assert not [path for path in folder.rglob("*") if path.is_file() and path.name != "campaign.json"]


def test_a_damaged_part_is_found(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    held = open_folder(folder)
    one = folder / part_name(1)
    one.write_bytes(one.read_bytes()[:-50])
    shutil.copy(folder / part_name(3), folder / part_name(2))
    faults = list(wrong_parts(held))
    assert len(faults) == 3  # unreadable, another part, and so too few runs
    assert "0000001.parquet" in faults[0]
    assert "another campaign or part" in faults[1]


def test_merge_needs_all_parts(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    import polars as pl

    assert pl.read_parquet(merge(open_folder(whole), tmp_path / "all.parquet")[0]).height == 180
    held = begin(campaign, tmp_path / "new")
    with pytest.raises(CampaignError, match="10 of 10 parts are missing"):
        merge(held, tmp_path / "none.parquet")


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "a/b", "1/0"])
def test_a_shard_is_one_of_several(text: str) -> None:
    with pytest.raises(CampaignError, match="K/N"):
        Shard.read(text)


@pytest.mark.slow
def test_a_disk_that_fills_up_stops_the_run_in_one_line_and_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "campaign.toml", tmp_path / "run"
    file.write_text(CAMPAIGN.format(runs=50, chunk=10, duration=20.0))
    assert main(["campaign", str(file), "-o", str(tmp_path / "whole")]) == 0
    capsys.readouterr()
    sync, written = os.fsync, 0

    def fills_up(handle: int) -> None:
        nonlocal written
        written += 1
        if written > 3:  # the manifest and two parts
            raise OSError(28, "No space left on device")
        sync(handle)

    monkeypatch.setattr(os, "fsync", fills_up)
    assert main(["campaign", str(file), "-o", str(out), "--threads", "1"]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert said[0].endswith(".parquet: No space left on device")
    assert len(list(out.rglob("*.parquet"))) == 2
    assert not [path for path in out.rglob("*") if path.is_file() and path.suffix == ".tmp"]
    monkeypatch.setattr(os, "fsync", sync)
    assert main(["campaign", str(file), "-o", str(out)]) == 0
    assert open_folder(out).digest() == open_folder(tmp_path / "whole").digest()


@pytest.mark.slow
def test_workers_without_a_compiler_are_told_of_once(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SEATRIAL_CC", "none")
    few = replace(campaign, runs=20, chunk=10)
    with pool_of(1) as threads, pytest.warns(EngineNotice, match="SEATRIAL_CC") as said:
        run_in(few, tmp_path / "run", pool=replace(threads, away=True))
    assert sum("other last digits" in str(one.message) for one in said) == 1


def test_a_worker_of_another_version_writes_nothing(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pool_of(1) as threads:
        submit = threads.executor.submit

        class Older:
            def submit(self, fn: object, version: str, *piece: object) -> object:
                return submit(fn, "0.0.1", *piece)  # type: ignore[arg-type]

        with pytest.raises(RunError, match=r"a worker has seatrial .*, this is 0\.0\.1"):
            run_in(campaign, tmp_path / "run", pool=replace(threads, executor=Older(), away=True))  # type: ignore[arg-type]
    assert not list((tmp_path / "run").rglob("*.parquet"))
