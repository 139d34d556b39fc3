"""Times beside those of installed peers, as ratios."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ... import bench as room
from ...bench import Peer, Row
from ...bench.timing import control_loop, machine
from ...core.files import write_whole
from .. import RequestError
from ..request import Note, make_folder, silent

_BUSY = 1.15
"""Ratio of the slowest to the quickest control loop above which the machine had other work."""
_LOOPS = 3


def bench(names: Sequence[str] = (), out: Path | None = None, note: Note = silent) -> dict[str, Any]:
    """Measure the peers of these names that are installed, or all, and write bench.json to the folder `out`.

    Returns:
        The rows with times and ratios, the peers that are not installed, and those that failed.

    Raises:
        RequestError: a peer that is not known, or a folder that cannot be made.
    """
    chosen = peers(names)
    if out is not None:
        make_folder(out)
    result = _measured(chosen, note)
    if out is not None:
        write_whole(out / "bench.json", json.dumps(result, indent=1) + "\n")
    return result


def peers(names: Sequence[str] = ()) -> tuple[Peer, ...]:
    """The peers of these names, or all."""
    known = {peer.name: peer for peer in room.PEERS}
    for name in names:
        if name not in known:
            raise RequestError(f"no benchmark '{name}'; known: {', '.join(known)}")
    return tuple(peer for peer in room.PEERS if peer.name in names or not names)


def state(peer: Peer) -> str:
    """Whether a peer is installed, and its version or how to get it."""
    return " ".join(("installed", peer.version)).rstrip() if peer.installed else f"not installed: {peer.get}"


def _measured(chosen: Sequence[Peer], note: Note) -> dict[str, Any]:
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
                warnings.simplefilter("ignore")  # warnings of the peer itself do not concern the user
                rows += [_row(peer, row) for row in peer.measure()]
        except Exception as error:  # another version of the peer may raise anything
            why = " ".join(f"{type(error).__name__}: {error}".split())
            failed.append({"peer": peer.name, "why": f"{why} ({state(peer)})"})
        loops.append(control_loop())
    missing = [{"peer": peer.name, "get": peer.get} for peer in chosen if not peer.installed]
    return {"machine": machine(), "control_loop_ms": min(loops), "slowest_control_loop_ms": max(loops),
            "busy": max(loops) > _BUSY * min(loops), "rows": rows, "not_installed": missing,
            "failed": failed}  # fmt: skip


def _row(peer: Peer, row: Row) -> dict[str, Any]:
    return {"peer": peer.name, "version": peer.version, "what": row.what, "ours_s": row.ours, "theirs_s": row.theirs,
            "ratio": row.ratio}  # fmt: skip
