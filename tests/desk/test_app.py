"""The door of the page: who is let in, what comes in, what goes out, and that nothing leads out of the folder."""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi")
from seatrial.data.prepare import read_steps
from seatrial.desk.app import desk, new_key
from seatrial.desk.jobs import Jobs
from seatrial.realtime import pages

KEY = "the key"


@dataclass(frozen=True)
class Served:
    """A page in this process; `ask` has its cookie unless told otherwise."""

    port: int
    folder: Path

    def ask(self, method: str, path: str, said: object = None, **headers: str) -> tuple[int, dict[str, str], str]:
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        body = said if isinstance(said, bytes | None) else json.dumps(said).encode()
        given = {"Cookie": f"seatrial-open={KEY}", "Host": f"127.0.0.1:{self.port}", **headers}
        wire.putrequest(method, path, skip_host=True)
        for name, value in {**given, "Content-Length": str(len(body or b""))}.items():
            wire.putheader(name, value)
        wire.endheaders(body)
        answer = wire.getresponse()
        found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read().decode()
        wire.close()
        return found

    def told(self, method: str, path: str, said: object = None) -> Any:
        status, _, text = self.ask(method, path, said)
        assert status == 200, text
        return json.loads(text)

    def refused(self, method: str, path: str, said: object = None) -> str:
        status, _, text = self.ask(method, path, said)
        assert 400 <= status < 500, text
        return str(json.loads(text)["error"])


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    folder = tmp_path / "work"
    folder.mkdir()
    (tmp_path / "secret.txt").write_text("secret")
    serving = pages.server(desk(folder, Jobs(folder), KEY))
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(64)
        thread = threading.Thread(target=lambda: asyncio.run(pages.attend(serving, listening)))
        thread.start()
        end = time.monotonic() + 5.0
        while not serving.started and time.monotonic() < end:
            time.sleep(0.005)
        try:
            yield Served(listening.getsockname()[1], folder)
        finally:
            serving.should_exit = True
            thread.join(10.0)


def test_only_who_has_the_key_is_served_and_it_becomes_a_cookie(served: Served) -> None:
    for path in ("/", "/api/shelf", "/shared/base.css", "/files/x"):
        assert served.ask("GET", path, Cookie="")[0] == 403
        assert served.ask("GET", path, Cookie="seatrial-open=other")[0] == 403
    assert served.ask("GET", "/?key=other", Cookie="")[0] == 403
    status, headers, _ = served.ask("GET", "/?key=the%20key", Cookie="")
    assert (status, headers["location"]) == (303, "/")
    assert {"httponly", "samesite=lax"} <= {part.strip().lower() for part in headers["set-cookie"].split(";")}
    assert "Drop logs" in served.ask("GET", "/")[2]
    assert len({new_key() for _ in range(50)}) == 50
    assert len(new_key()) >= 20


def test_other_sites_change_nothing_and_other_names_lead_nowhere(served: Served) -> None:
    said = {"trial": "a", "stretches": [[0, 1]], "out": "cuts.toml"}
    assert served.ask("POST", "/api/cut", said, Origin="http://evil.example")[0] == 403
    assert served.ask("POST", "/api/cut", said, Origin="null")[0] == 403
    assert served.ask("GET", "/api/shelf", Host="evil.example")[0] == 400
    assert not (served.folder / "cuts.toml").exists()
    assert served.ask("POST", "/api/cut", said, Origin=f"http://127.0.0.1:{served.port}")[0] == 200
    assert read_steps(served.folder / "cuts.toml")[0].where == ((0.0, 1.0),)


@pytest.mark.parametrize("path", ["/files/../secret.txt", "/files/%2e%2e/secret.txt", "/files/..%2fsecret.txt",
                                  "/files//etc/passwd", "/api/text/%2e%2e%2fsecret.txt", "/files/.seatrial/0001.txt",
                                  "/api/trial/..%5csecret.txt"])  # fmt: skip
def test_nothing_leads_out_of_the_folder(served: Served, path: str) -> None:
    status, _, text = served.ask("GET", path)
    assert 400 <= status < 500
    assert "secret" not in text.replace("secret.txt", "")


@pytest.mark.slow
def test_a_file_comes_in_pieces_and_has_its_name_at_the_end(served: Served) -> None:
    assert served.told("PUT", "/api/files/day%201.nmea?at=0&last=false", b"$GP")["path"] == "logs/day 1.nmea"
    assert served.told("GET", "/api/shelf")["items"] == []
    assert "missing" in served.refused("PUT", "/api/files/day%201.nmea?at=9&last=true", b"RMC")
    served.told("PUT", "/api/files/day%201.nmea?at=3&last=true", b"RMC")
    assert (served.folder / "logs" / "day 1.nmea").read_bytes() == b"$GPRMC"
    assert "there already" in served.refused("PUT", "/api/files/day%201.nmea?at=0&last=true", b"other")
    assert served.told("GET", "/api/shelf")["items"] == [
        {"path": "logs", "kind": "logs", "size": 1, "names": [], "format": ""}]  # fmt: skip
    assert "no name" in served.refused("PUT", "/api/files/..%2fx.csv?at=0&last=true", b"")
    assert "bytes" in served.refused("PUT", "/api/files/large.csv?at=0&last=true", b"x" * (4 * 2**20 + 1))
    served.told("PUT", "/api/files/again.csv?at=0&last=false", b"half")  # the page was closed
    served.told("PUT", "/api/files/again.csv?at=0&last=true", b"whole")
    assert (served.folder / "logs" / "again.csv").read_bytes() == b"whole"
    served.told("PUT", "/api/files/study.toml?at=0&last=true", b'schema = "seatrial-study/1"')
    assert (served.folder / "study.toml").exists()


def test_a_text_that_another_tab_has_changed_is_not_overwritten(served: Served) -> None:
    (served.folder / "study.toml").write_text("one")
    was = served.told("GET", "/api/text/study.toml")["text"]
    served.told("PUT", "/api/text/study.toml", {"text": "two", "was": was})
    assert "has changed" in served.refused("PUT", "/api/text/study.toml", {"text": "three", "was": was})
    assert (served.folder / "study.toml").read_text() == "two"
    (served.folder / "x.fmu").write_bytes(b"\xff\x00")
    assert "no text" in served.refused("GET", "/api/text/x.fmu")
    assert "takes 'text'" in served.refused("PUT", "/api/text/study.toml", {"text": 1})
    (served.folder / "long.toml").write_bytes(b" " * (2**20 + 1))
    assert "longer" in served.refused("GET", "/api/text/long.toml")


def test_pages_of_the_folder_run_apart_and_other_files_are_downloads(served: Served) -> None:
    (served.folder / "report.html").write_text("<script>1</script>")
    (served.folder / "drawing.svg").write_text("<svg/>")
    (served.folder / "model.toml").write_text("x = 1")
    for name in ("report.html", "drawing.svg"):
        policy = served.ask("GET", f"/files/{name}")[1]["content-security-policy"]
        assert "sandbox" in policy
        assert "allow-same-origin" not in policy
        assert "default-src 'none'" in policy
        assert "connect-src" not in policy
    headers = served.ask("GET", "/files/model.toml")[1]
    assert headers["content-disposition"].startswith("attachment")
    assert headers["content-security-policy"].startswith("default-src 'self'")
    assert served.ask("GET", "/")[1]["content-security-policy"].startswith("default-src 'self'")


def test_a_command_is_shown_before_it_runs_and_refused_in_words(served: Served) -> None:
    shown = served.told("POST", "/api/command/copy?run=false", {"ship": "kvlcc2", "out": "ship.toml"})
    assert shown["arguments"] == ["copy", "kvlcc2", "ship.toml"]
    assert not (served.folder / ".seatrial").exists()
    assert "is missing" in served.told("POST", "/api/command/copy?run=false", {"ship": "kvlcc2"})["lacks"]
    assert "is missing" in served.refused("POST", "/api/command/copy?run=true", {"ship": "kvlcc2"})
    assert "action" in served.refused("POST", "/api/command/rm?run=true", {})
    for said in (b"[1]", b"{", b"[" * 100_000):
        assert "one JSON object" in served.refused("POST", "/api/command/copy?run=true", said)
    assert "pairs" in served.refused("POST", "/api/cut", {"trial": "a", "stretches": [1], "out": "c.toml"})
    assert "no command 7" in served.refused("GET", "/api/jobs/7")
    assert "kvlcc2_l7" in served.told("GET", "/api/catalogue")["ships"]


@pytest.mark.slow
def test_a_command_runs_and_says_what_it_did(served: Served) -> None:
    given = {"L_pp": 100, "B": 16, "d": 6, "C_b": 0.7, "out": "ship.toml"}
    number = served.told("POST", "/api/command/estimate?run=true", given)["number"]
    end = time.monotonic() + 60.0
    while (job := served.told("GET", f"/api/jobs/{number}"))["state"] == "running" and time.monotonic() < end:
        time.sleep(0.1)
    assert job["state"] == "done", job
    assert job["command"] == "seatrial estimate ship_particulars.toml -o ship.toml"
    items = {one["path"]: one["kind"] for one in served.told("GET", "/api/shelf")["items"]}
    assert items == {"ship.toml": "ship", "ship_particulars.toml": "particulars"}
