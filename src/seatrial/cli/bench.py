"""The command bench: times beside those of installed peers, as ratios."""

from __future__ import annotations

import json as to_json
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import bench as room
from ..bench import Peer, Row
from ..bench.timing import control_loop, machine
from ..core.files import write_whole
from ..engine import SimulationError
from .support import UsageError, emit, make_folder, note, say, show_table

_BUSY = 1.15
"""The control loop at its slowest over its quickest from which the machine had other work."""
_LOOPS = 3


def bench(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]...", help="Peers; else all.")] = None,
    listed: Annotated[bool, typer.Option("--list", help="Say which peers there are, and measure nothing.")] = False,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for bench.json.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")] = False,
) -> None:
    """Times beside those of other programs that are installed here, as ratios.

    Raises:
        UsageError: a peer that is not known, or a folder that cannot be made.
        SimulationError: a peer that is there but cannot be measured; the others are.
    """
    chosen = _chosen(names or [])
    if listed:
        _list(chosen, json)
        return
    if out is not None:
        make_folder(out)
    result = _measured(chosen)
    if out is not None:
        write_whole(out / "bench.json", to_json.dumps(result, indent=1) + "\n")
    if json:
        emit(result)
    else:
        _show(result)
    if out is not None:
        note(f"wrote {out / 'bench.json'}")
    if result["failed"]:
        raise SimulationError("; ".join(f"{one['peer']} cannot be measured: {one['why']}" for one in result["failed"]))


def _chosen(names: Sequence[str]) -> tuple[Peer, ...]:
    known = {peer.name: peer for peer in room.PEERS}
    for name in names:
        if name not in known:
            raise UsageError(f"no benchmark '{name}'; known: {', '.join(known)}")
    return tuple(peer for peer in room.PEERS if peer.name in names or not names)


def _list(chosen: Sequence[Peer], json: bool) -> None:
    rows = [(peer.name, peer.about, _state(peer)) for peer in chosen]
    if json:
        emit({"peers": [{"name": n, "about": about, "installed": peer.installed}
                        for peer, (n, about, _) in zip(chosen, rows, strict=True)]})  # fmt: skip
    else:
        show_table(("peer", "what is compared with", "here"), rows)


def _state(peer: Peer) -> str:
    return " ".join(("installed", peer.version)).rstrip() if peer.installed else f"not installed: {peer.get}"


def _measured(chosen: Sequence[Peer]) -> dict[str, Any]:
    """Rows of what is installed, the control loop before, between and after."""
    rows: list[dict[str, Any]] = []
    failed: list[dict[str, str]] = []
    loops = [control_loop() for _ in range(_LOOPS)]
    for peer in chosen:
        if not peer.installed:
            continue
        note(f"measuring: {peer.about}")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of the peer's own, which are none of the user's business
                rows += [_row(peer, row) for row in peer.measure()]
        except Exception as error:  # whatever another version of the peer comes up with
            why = " ".join(f"{type(error).__name__}: {error}".split())
            failed.append({"peer": peer.name, "why": f"{why} ({_state(peer)})"})
        loops.append(control_loop())
    missing = [{"peer": peer.name, "get": peer.get} for peer in chosen if not peer.installed]
    return {"machine": machine(), "control_loop_ms": min(loops), "slowest_control_loop_ms": max(loops),
            "busy": max(loops) > _BUSY * min(loops), "rows": rows, "not_installed": missing,
            "failed": failed}  # fmt: skip


def _row(peer: Peer, row: Row) -> dict[str, Any]:
    return {"peer": peer.name, "version": peer.version, "what": row.what, "ours_s": row.ours, "theirs_s": row.theirs,
            "ratio": row.ratio}  # fmt: skip


def _show(result: dict[str, Any]) -> None:
    rows = [(r["peer"], r["what"], _time(r["ours_s"]), _time(r["theirs_s"]), f"{r['ratio']:.3g} x")
            for r in result["rows"]]  # fmt: skip
    if rows:
        show_table(("peer", "time of", "ours", "theirs", "ratio"), rows, right=(2, 3, 4))
    for missing in result["not_installed"]:
        say(f"{missing['peer']}: not installed ({missing['get']})\n")
    loops = f"{result['control_loop_ms']:.1f} to {result['slowest_control_loop_ms']:.1f} ms"
    say(f"{result['machine']}; Python control loop {loops}\n")
    if result["busy"]:
        note("note: the machine had other work: the control loop varied; measure again when it is at rest")


def _time(seconds: float) -> str:
    """Three digits with the unit that suits them."""
    power = min(max(math.floor(math.log10(seconds) / 3), -3), 0)
    return f"{seconds / 10.0 ** (3 * power):.3g} {('s', 'ms', 'us', 'ns')[-power]}"
