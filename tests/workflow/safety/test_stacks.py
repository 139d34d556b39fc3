"""Stacks of every kind with an autopilot behind them that keeps clear: two encounters each, and silence.

What a program hears is NMEA, whatever it steers by; the ships of its runs are as the range has them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fmus
from seatrial.core.errors import RequestError
from seatrial.data import Array
from seatrial.encounters.avoiding import good
from seatrial.encounters.conduct import Orders, Scene
from seatrial.encounters.learning import Sight
from seatrial.encounters.meeting import Meeting
from seatrial.encounters.rules import judge
from seatrial.encounters.sailing import Sailed, Sea, sail
from seatrial.realtime.range.encounter import encountered
from seatrial.realtime.range.scenario import Scenario, ordinary
from seatrial.ships.files import load
from seatrial.workflow.safety.outside import Ran, Spoken, ran
from seatrial.workflow.safety.stacks import Guarded, Stack, beside, stack_of

PROGRAM = '''
import functools, http.client, json, math, operator, socket, struct, sys
import numpy as np
from seatrial.encounters.avoiding import good
from seatrial.encounters.conduct import Scene

kind, address, link, most = *sys.argv[1:4], int(sys.argv[4])
host, _, port = address.rpartition(":")
wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
wire.connect((host, int(port)))
wire.settimeout(20.0)
said, near, count, master = {}, {}, 0, None

def say(body):
    wire.send(f"${body}*{functools.reduce(operator.xor, body.encode()):02X}\\r\\n".encode())

def hear(lines):
    """Whether the time is told, which ends a tick."""
    for line in lines:
        f = line.partition("*")[0].split(",")
        if f[0][3:] == "HDT": said["psi"] = math.radians(float(f[1]))
        if f[0][3:] == "VBW": said["U"] = float(f[4]) / 1.9438445
        if f[0][3:] == "TTM" and f[2] and f[5]:
            near[f[1]] = [float(one) for one in (f[2], f[3], f[5], f[6])]
    return any(line[3:6] == "ZDA" for line in lines)

def steered():
    """The heading of the reference autopilot [rad], from who is heard around the own ship."""
    global master, count
    count += 1
    if count > most: sys.exit(0)
    if "psi" not in said or "U" not in said or not near: return said.get("psi", 0.0)
    far, toward, U, chi = np.array([near[one] for one in sorted(near)]).T
    x, y = 1852.0 * far * np.cos(np.radians(toward)), 1852.0 * far * np.sin(np.radians(toward))
    U, chi = U / 1.9438445, np.radians(chi)
    whole = [np.array([[own, *others]]) for own, others in (
        (0.0, x), (0.0, y), (said["psi"], chi), (said["U"] * math.cos(said["psi"]), U * np.cos(chi)),
        (said["U"] * math.sin(said["psi"]), U * np.sin(chi)))]
    scene = Scene(float(count), *whole, np.full(1 + len(near), 100.0))
    if master is None: master = good(scene)
    return float(master.look(scene).psi[0])

def hello():
    """No order: one by the wire would refuse those of the link."""
    say("AGZDA,120000.00,01,01,2026,00,00")

hello()
if kind == "nmea":
    give = lambda psi: say(f"AGHTC,V,,,H,N,,,,,{math.degrees(psi) % 360.0:.2f},,,T,C")
elif kind == "signalk":
    asked = http.client.HTTPConnection(link, timeout=10.0)
    def give(psi):
        asked.request("PUT", "/signalk/v2/api/vessels/self/autopilots/_default/target",
                      json.dumps({"value": psi, "units": "rad"}))
        asked.getresponse().read()
elif kind == "rosbridge":
    from websockets.sync.client import connect
    ros = connect(f"ws://{link}/rosbridge", proxy=None)
    give = lambda psi: ros.send(json.dumps({"op": "publish", "topic": "/cmd/psi", "msg": {"data": psi}}))
if kind != "ardupilot":
    while True:
        if hear(wire.recv(8192).decode().splitlines()):
            give(steered())
            if kind != "nmea": hello()

host, _, port = link.rpartition(":")
sitl = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sitl.connect((host, int(port)))
sitl.settimeout(20.0)
wire.setblocking(False)
wanted, delta, k = 0.0, 0.0, 0
while True:
    k += 1
    sitl.send(struct.pack("<HHI16H", 18458, 50, k, round(1500 + 500 * delta), *[1500] * 15))
    now = json.loads(sitl.recv(4096))
    try:
        while True:
            if hear(wire.recv(8192).decode().splitlines()):
                wanted = steered()
                hello()
    except BlockingIOError:
        pass
    off = math.remainder(wanted - now["attitude"][2], math.tau)
    delta = max(-0.5, min(0.5, 1.0 * off - 10.0 * now["imu"]["gyro"][2]))
'''
KINDS: tuple[Spoken, ...] = ("nmea", "signalk", "rosbridge", "ardupilot")
MET = {"head-on": (4800.0, 0.0, math.pi), "give-way": (2400.0, 2400.0, -0.5 * math.pi)}
"""Places and courses of a ship of 8 m/s that meets one of 8 m/s on course north after 300 s."""


def met(name: str) -> Scenario:
    x, y, psi = MET[name]
    one = Meeting(8.0, np.array([x]), np.array([y]), np.array([psi]), np.array([8.0]))
    return encountered(ordinary("own", 100.0, 8.0), one, ["ignores"])


def of(folder: Path, kind: Spoken, name: str, most: int = 100_000, lasts: float = 400.0, **more: Any) -> Ran:
    (folder / "stack.py").write_text(PROGRAM, encoding="utf-8")
    stack = Stack(speaks=kind, command=f"python stack.py {kind} {{address}} {{link}} {most}",
                  sends="HDT,VBW,TTM,ZDA", **more)  # fmt: skip
    wiring: Any = stack_of(stack, folder)
    return ran(replace(met(name), duration=lasts), wiring, kind)


@pytest.mark.slow
@pytest.mark.parametrize("name", MET)
@pytest.mark.parametrize("kind", KINDS)
def test_an_autopilot_behind_a_link_keeps_clear(tmp_path: Path, kind: Spoken, name: str) -> None:
    found = of(tmp_path, kind, name)
    assert found.tracks is not None
    assert (found.spoke, found.silent, found.valid) == (True, None, True)
    [own] = judge(found.tracks, own=True)
    assert not own.contact
    assert float(own.at.distance) > 300.0  # half a mile of a ship of 300 m
    assert own.own.starboard > math.radians(30.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS[1:])
def test_a_link_that_falls_silent_is_counted_and_its_last_orders_hold(tmp_path: Path, kind: Spoken) -> None:
    found = of(tmp_path, kind, "head-on", most=60, lasts=120.0, patience=60.0)
    assert found.tracks is not None
    assert found.spoke
    assert found.silent is not None
    assert 58.0 < found.silent < 63.0  # an answer a second
    assert found.tracks.t[-1] == pytest.approx(120.0, abs=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS[1:])
def test_a_run_by_a_link_is_the_same_again(tmp_path: Path, kind: Spoken) -> None:
    one, two = (of(tmp_path, kind, "give-way", lasts=60.0).tracks for _ in range(2))
    assert one is not None
    assert two is not None
    assert all((getattr(one, name) == getattr(two, name)).all() for name in ("t", "x", "y", "psi"))


FMU = r'''
/* 0 to 4: own x, y, psi, north, east; 5 to 11: target x, y, psi, north, east, L, valid; 20: order.psi */
static void begin(M *m, D *v) { m->kept[0] = v[2]; }
static S step(M *m, D *v, D t, D dt) {
  if (t > LAST) return 3;
  D course = m->kept[0], *away = &m->kept[1];
  D U = hypot(v[3], v[4]), a = v[8] - U * cos(course), b = v[9] - U * sin(course);
  D x = v[5] - v[0], y = v[6] - v[1], left = -(x * a + y * b) / (a * a + b * b + 1e-9);
  D near = hypot(x + left * a, y + left * b), L = v[10];
  D beta = remainder(atan2(y, x) - course, 2 * PI);
  int risk = left > 0 && near < 4.5 * L && left < 1200 * sqrt(L / 300);
  if (!*away && v[11] > 0.5 && beta > -0.1 && risk) *away = 1;
  if (*away && (near > 4.5 * L || left < 0)) *away = 0;
  v[20] = course + *away * PI / 3;
  return 0;
}
'''
_SHIP = ("x", "y", "psi", "north", "east", "L", "valid")
NAMES = {f"own.{one}": k for k, one in enumerate(_SHIP[:5])}
NAMES |= {f"target[1].{one}": k for k, one in enumerate(_SHIP, 5)}


def fmu(folder: Path, last: float = 1e9, unit: str = "rad", names: dict[str, int] = NAMES) -> Path:
    """A controller in C that gives way to starboard, as an FMU of FMI 2.0 that fails after `last` seconds."""
    reals = [*(fmus.Real(name, k) for name, k in names.items()), fmus.Real("order.psi", 20, "output", unit)]
    return fmus.fmu(folder, "c", FMU.replace("LAST", repr(last)), reals)


POLICY = '''
import numpy as np

class Policy:
    """Alters 60 deg to starboard for the nearest ship while that is not abaft the port beam and would pass near."""
    count = 0

    def predict(self, seen, deterministic=False):
        assert deterministic
        self.count += 1
        if self.count > LAST:
            raise RuntimeError("lost")
        here, near, s, c, *_, closest, soon = seen[:, 4:13].T
        off = np.abs(seen[:, 0]) > 0.3
        away = (here > 0) & np.where(off, c > -0.2, (s > -0.35) & (c > -0.4) & (closest > np.exp(-1.4)))
        return np.column_stack([0.5 * away, np.ones(len(seen))]), None

def load():
    return Policy()
'''


def called(stack: Any) -> Sailed:
    """Two encounters of a model of 7 m, head-on and crossing, after 120 s."""
    ship = load("kvlcc2_l7")
    U, T = 1.17, 120.0
    x, y = np.array([[2.0 * U * T], [U * T]]), np.array([[0.0], [U * T]])
    some = Meeting(np.array([U, U]), x, y, np.array([[math.pi], [-0.5 * math.pi]]), np.full((2, 1), U))
    return sail(ship, some, Sea(260.0, 2.0), stack, ["ignores"], 1)


def clears(found: Sailed) -> None:
    [own] = judge(found.tracks, own=True)
    assert found.runs.tolist() == [0, 1]
    assert np.isnan(found.silent).all()
    assert not own.contact.any()
    assert (own.at.distance > 21.0).all()  # half a mile, of 7 m for 300
    assert (own.own.starboard > math.radians(30.0)).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["python", "fmu", "gymnasium"])
def test_a_stack_that_is_called_keeps_clear_and_its_silence_is_counted(tmp_path: Path, kind: str) -> None:
    def made(last: float) -> Any:
        if kind == "fmu":
            return Stack(speaks="fmu", file=fmu(tmp_path, last).name)
        looks = int(min(2.0 * last, 1e9))
        if kind == "gymnasium":
            (tmp_path / "policy.py").write_text(POLICY.replace("LAST", str(looks)), encoding="utf-8")
            return Stack(speaks="gymnasium", file="policy.py:load")
        (tmp_path / "policy.py").write_text(
            "from seatrial.encounters.avoiding import good\n"
            "class Mine:\n"
            "    def __init__(self, scene): self.count, self.inner = 0, good(scene)\n"
            "    def look(self, scene):\n"
            f"        self.count += 1\n        assert self.count <= {looks}\n"
            "        return self.inner.look(scene)\n", encoding="utf-8")  # fmt: skip
        return "policy.py:Mine"

    clears(called(stack_of(made(1e9), tmp_path)))
    silent = called(stack_of(made(20.0), tmp_path))
    assert silent.silent == pytest.approx([20.0, 20.0], abs=0.51)
    assert (np.abs(np.diff(silent.tracks.psi[:, 0, -10:])) < 0.01).all()  # the last orders hold


@pytest.mark.slow
def test_orders_that_are_none_hold_the_last_ones_in_their_run_alone() -> None:
    class Half:
        def look(self, scene: Scene) -> Orders:
            gone = np.array([np.nan, 0.3]) if scene.t >= 5.0 else np.full(2, 0.2)
            return Orders(gone, np.ones(2))

    found = called(lambda scene: Half())
    assert found.silent.tolist()[0] == 5.0
    assert math.isnan(found.silent[1])
    assert found.tracks.psi[:, 0, -1] == pytest.approx([0.2, 0.3], abs=0.02)


def test_a_stack_that_fails_at_once_is_a_wrong_request() -> None:
    scene = Scene(0.0, *np.zeros((5, 2, 2)), np.array([7.0, 7.0]))

    class Broken:
        def __init__(self, orders: Any) -> None:
            self.orders = orders

        def look(self, scene: Scene) -> Any:
            return self.orders

    for orders, said in ((Orders(np.zeros(3), np.ones(3)), "orders of shape"), (None, "TypeError"),
                         (Orders(np.zeros(2), np.ones(1)), "there are 2 runs")):  # fmt: skip
        with pytest.raises(RequestError, match=said):
            Guarded(lambda scene, orders=orders: Broken(orders), "mine.py:begin")(scene).look(scene)


@pytest.mark.parametrize(("stack", "said"), [
    (Stack(), 'speaks "nmea" has a command, and no file'),
    (Stack(command="python a.py", file="a.fmu"), 'speaks "nmea" has a command, and no file'),
    (Stack(speaks="fmu", command="a.fmu"), 'speaks "fmu" has a file, and no command'),
    (Stack(speaks="gymnasium", file="none.py:load"), "no such Python file"),
    (Stack(speaks="gymnasium", file="here.py:load"), "has no predict"),
    (Stack(speaks="gymnasium", file="here.py"), "write FILE.py:NAME"),
    (Stack(speaks="gymnasium", file="here.py:load", reads=("none.npy",)), r"stack\.reads: .*none\.npy: no such file"),
    ("here.py:none", "has no function none"),
    ("rulez", "stack: no conduct 'rulez'"),
])  # fmt: skip
def test_a_stack_that_cannot_be_is_a_line(tmp_path: Path, stack: Any, said: str) -> None:
    (tmp_path / "here.py").write_text("def load():\n    return 3\n", encoding="utf-8")
    with pytest.raises(RequestError, match=said):
        stack_of(stack, tmp_path)


@pytest.mark.slow
def test_an_fmu_that_is_no_controller_is_a_line(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=r"none\.fmu: no such file"):
        stack_of(Stack(speaks="fmu", file="none.fmu"), tmp_path)
    (tmp_path / "text.fmu").write_text("no archive", encoding="utf-8")
    with pytest.raises(RequestError, match="not an FMU"):
        stack_of(Stack(speaks="fmu", file="text.fmu"), tmp_path)
    with pytest.raises(RequestError, match=r"order\.psi is in deg; it is in rad here"):
        stack_of(Stack(speaks="fmu", file=fmu(tmp_path, unit="deg").name), tmp_path)
    with pytest.raises(RequestError, match=r"a controller has inputs such as own\.psi"):
        stack_of(Stack(speaks="fmu", file=fmu(tmp_path, names={"own.x": 0}).name), tmp_path)
    stack: Any = stack_of(Stack(speaks="fmu", file=fmu(tmp_path).name), tmp_path)
    with pytest.raises(RequestError, match="takes 1 targets, 2 are met"):
        stack(Scene(0.0, *np.zeros((5, 1, 3)), np.full(3, 7.0)))


def test_the_files_of_a_stack_are_those_that_it_names() -> None:
    assert beside("mine.py:begin") == ["mine.py"]
    assert beside(Stack(speaks="fmu", file="a.fmu", reads=("b.npy",))) == ["a.fmu", "b.npy"]
    assert beside(Stack(command="python a.py {address}")) == ["python", "a.py", "{address}"]


def looked(x: Array, y: Array, psi: Array) -> tuple[Sight, Scene]:
    """An own ship of 300 m at the first place and others, all at 5 m/s."""
    U = np.full(len(x), 5.0)
    scene = Scene(0.0, x[None], y[None], psi[None], (U * np.cos(psi))[None], (U * np.sin(psi))[None],
                  np.full(len(x), 300.0))  # fmt: skip
    return Sight(scene), scene


def test_what_a_policy_sees_of_a_ship_ahead() -> None:
    sight, scene = looked(np.array([0.0, 3704.0]), np.zeros(2), np.array([0.0, math.pi]))
    own, [here, near, sin_b, cos_b, _, cos_c, speed, closest, soon] = np.split(sight.observed(scene)[0][:13], [4])
    assert own.tolist() == [0.0, 1.0, 0.0, 0.0]
    assert (here, sin_b, cos_b, cos_c, speed, closest) == pytest.approx((1.0, 0.0, 1.0, -1.0, 0.0, 1.0))
    assert near == pytest.approx(math.exp(-1.0))  # 2 of 4 half miles of 926 m
    assert soon == pytest.approx(math.exp(-370.4 / 1200.0))


def test_the_nearest_ships_come_first_and_who_is_not_seen_is_zero() -> None:
    far = np.array([0.0, 9000.0, 3000.0, -1e6, 6000.0, 5000.0])
    sight, scene = looked(far, np.zeros(6), np.zeros(6))
    seen = sight.observed(scene)[0][4:].reshape(3, 9)
    assert seen[:, 1] == pytest.approx(np.exp(-np.array([3000.0, 5000.0, 6000.0]) / 3704.0))
    sight, scene = looked(far[[0, 3]], np.zeros(2), np.zeros(2))
    assert not sight.observed(scene)[0][4:].any()


def test_actions_alter_the_old_course_and_slow() -> None:
    sight, scene = looked(np.array([0.0, 9e3]), np.zeros(2), np.array([0.5, 0.0]))
    psi, speed = sight.ordered(np.array([[0.5, -1.0]]))
    assert (psi[0], speed[0]) == pytest.approx((0.5 + math.radians(60.0), 0.5))
    assert sight.ordered(np.array([[9.0, 9.0]])) == sight.ordered(np.array([[1.0, 1.0]]))
    step = np.array([[1.0, 0.0]])
    moved = replace(scene, x=scene.x + 100.0 * step, y=scene.y + 200.0 * step, psi=scene.psi + 0.1 * step)
    seen = sight.observed(moved)[0]
    across = 200.0 * math.cos(0.5) - 100.0 * math.sin(0.5)
    assert seen[:3] == pytest.approx((math.sin(0.1), math.cos(0.1), math.tanh(across / 3704.0)), abs=1e-6)


def test_the_reference_is_a_stack_too(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("from seatrial.encounters.avoiding import good\n", encoding="utf-8")
    stack: Any = stack_of("a.py:good", tmp_path)
    _, scene = looked(np.array([0.0, 6000.0]), np.zeros(2), np.array([0.0, math.pi]))
    assert stack(scene).look(scene).psi == good(scene).look(scene).psi
