"""Commands as processes: their words and their ends are files."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import pytest

from seatrial.core.errors import RequestError
from seatrial.desk.jobs import AT_ONCE, Job, Jobs


def ended(jobs: Jobs, number: int, seconds: float = 60.0) -> dict[str, Any]:
    end = time.monotonic() + seconds
    while (said := jobs.said(number, 0))["state"] == "running":
        assert time.monotonic() < end
        time.sleep(0.05)
    return said


@pytest.mark.slow
def test_a_command_runs_in_the_folder_and_its_words_are_kept(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path)
    job = jobs.start(["copy", "kvlcc2_l7", "my ship.toml"])
    assert job.command == "seatrial copy kvlcc2_l7 'my ship.toml'"
    said = ended(jobs, job.number)
    assert (said["state"], said["status"]) == ("done", 0)
    assert (tmp_path / "my ship.toml").exists()
    assert "my ship.toml" in said["text"]
    assert jobs.said(job.number, said["read"])["text"] == ""
    later = jobs.said(job.number, 3)
    assert (later["text"], later["read"]) == (said["text"].encode()[3:].decode(), said["read"])
    other = Jobs(tmp_path)  # a page that is opened later
    assert [one["state"] for one in other.every()] == ["done"]
    wrong = other.start(["copy", "kvlcc2_l8", "x.toml"])
    assert wrong.number == 2
    assert (ended(other, 2)["state"], other.said(2, 0)["status"]) == ("failed", 2)
    assert [one["number"] for one in other.every()] == [2, 1]


@pytest.mark.slow
def test_a_command_is_stopped_as_by_ctrl_c_and_all_are_when_the_page_ends(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path)
    numbers = [jobs.start(["open", ".", "--port", "0"]).number for _ in range(2)]  # which runs until it is stopped
    end = time.monotonic() + 60.0
    while not all("Ctrl-C" in jobs.said(number, 0)["text"] for number in numbers):
        assert time.monotonic() < end
        time.sleep(0.1)
    assert [one["state"] for one in jobs.every()] == ["running", "running"]
    jobs.stop(numbers[0])
    assert ended(jobs, numbers[0])["state"] == "done"
    assert jobs.said(numbers[1], 0)["state"] == "running"
    jobs.close()
    assert ended(jobs, numbers[1])["state"] != "running"
    jobs.stop(numbers[1])  # one that has ended is left alone
    with pytest.raises(RequestError, match="no command 9"):
        jobs.said(9, 0)


def test_no_more_than_a_few_run_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow:
        pid = os.getpid()

        def __init__(self, *_: Any, **__: Any) -> None: ...

        def poll(self) -> None: ...

        def wait(self, _: float | None = None) -> int:
            time.sleep(30.0)
            return 0

    monkeypatch.setattr("seatrial.desk.jobs.subprocess.Popen", Slow)
    jobs = Jobs(tmp_path)
    for _ in range(AT_ONCE):
        jobs.start(["ships"])
    with pytest.raises(RequestError, match="wait for one"):
        jobs.start(["ships"])
    assert len(jobs.every()) == AT_ONCE


def test_a_job_of_a_page_that_was_killed_does_not_run_for_ever(tmp_path: Path) -> None:
    where = tmp_path / ".seatrial"
    where.mkdir()
    (where / "0001.json").write_text(json.dumps(vars(Job(1, ("ships",), 0.0, 1))))
    (where / "0001.txt").write_text("half")
    (where / "0002.json").write_text("[broken")
    jobs = Jobs(tmp_path)
    assert [one["state"] for one in jobs.every()] == ["ended with its page"]
    assert jobs.said(1, 0)["text"] == "half"
    with pytest.raises(RequestError, match="no command 2"):
        jobs.said(2, 0)
