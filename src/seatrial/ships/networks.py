"""The [network] table of a ship file, and the weights in a file beside it.

The two files are read as one: the table holds the SHA-256 of the weights, and a write that is cut off
leaves the old pair or the new one, never half of each.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..core.files import packed, write_whole
from ..core.parameters import ParameterError, unknown
from ..core.unpacking import unpacked
from ..models.network import INPUTS, KINDS, Limits, Network
from . import ShipError

USUAL = "weights.npz"
"""The file of weights where a ship's file names none."""
_KEYS = {"kind": str, "layers": list, "wind": bool, "scale": list, "memory": int, "weights": str, "sha256": str,
         "limits": dict}  # fmt: skip
_LIMITS = {"low": list, "high": list, "acceleration": list, "rate": (int, float)}
_SAID = {str: "a text", list: "a list of numbers", bool: "true or false", int: "a whole number", dict: "a table"}


def weights_name(path: Path) -> str:
    """Name of the file of weights of a ship file: its own where several ships share a folder."""
    return USUAL if path.stem == "model" else f"{path.stem}.weights.npz"


def read_network(path: Path, table: Mapping[str, Any]) -> Network:
    """The network of the ship file at `path` from its [network] table, with the weights beside it.

    Raises:
        ShipError: a key or value that cannot be used, weights that are absent or not those of the ship file.
    """
    _check(f"{path}: network", table, _KEYS, ("kind", "layers"))
    limits = table.get("limits")
    if limits is not None:
        _check(f"{path}: network.limits", limits, _LIMITS, ("low", "high", "acceleration"))
    form: dict[str, Any] = {key: table[key] for key in ("kind", "wind", "memory") if key in table}
    form |= {key: tuple(table[key]) for key in ("layers", "scale") if key in table}
    try:
        if limits is not None:
            low, high, most = (tuple(map(float, limits[key])) for key in ("low", "high", "acceleration"))
            form["limits"] = Limits(low, high, most, float(limits.get("rate", Limits.rate)))
        network = Network(**form)
        return _weighted(path, table, network) if "weights" in table else network
    except ParameterError as error:
        raise ShipError(f"{path}: network: {error}") from None


def _check(where: str, table: Mapping[str, Any], known: Mapping[str, Any], required: tuple[str, ...]) -> None:
    for key, value in table.items():
        if key not in known:
            raise ShipError(f"{where}: {unknown(key, known, 'key')}")
        kind = known[key]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool) or not _numeric(value):
            raise ShipError(f"{where}.{key} is {value!r}; it is {_SAID.get(kind, 'a number')}")
        if key == "layers" and any(type(n) is not int for n in table["layers"]):
            raise ShipError(f"{where}.layers is {value!r}; it is a list of whole numbers")
    missing = [key for key in required if key not in table]
    if missing:
        wanted = f" (kind: {', '.join(KINDS)})" if "kind" in missing else ""
        raise ShipError(f"{where}: missing {', '.join(missing)}{wanted}")


def _numeric(value: Any) -> bool:
    """Whether it is no list, or a list of numbers."""
    return not isinstance(value, list) or all(type(x) in (int, float) for x in value)  # type: ignore[misc]


def _weighted(path: Path, table: Mapping[str, Any], network: Network) -> Network:
    """The network with the weights that its table names; those of a save that was cut off count."""
    name, wanted = table["weights"], table.get("sha256")
    if not isinstance(name, str) or not name or Path(name).name != name:
        raise ShipError(f"{path}: network.weights is {name!r}; name a file beside the ship file")
    if wanted is None:
        raise ShipError(f"{path}: network: missing sha256, the digest of {name}")
    beside = path.parent / name
    found: Network | None = None
    for file in (beside, _waiting(beside, wanted), beside):  # the last once more, had it just been moved
        if file.is_file():
            found = network.having(_arrays(file))
            if found.digest == wanted:
                return found
    if found is None:
        raise ShipError(f"{path}: no {name} beside it; a network is its ship file and that file together")
    raise ShipError(
        f"{beside}: holds weights of sha256 {found.digest[:12]}, {path.name} says {wanted[:12]}; "
        "take the two files of one fit"
    )


def _arrays(file: Path) -> dict[str, Any]:
    try:
        return unpacked(file.read_bytes())
    except OSError as error:
        raise ShipError(f"{file}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        remedy = "take it from the run that made the ship file, or train again"
        raise ShipError(f"{file}: holds no weights, or is cut off or damaged; {remedy}") from None


def network_lines(network: Network, name: str) -> Iterator[str]:
    """The [network] table of a ship file whose weights are in `name`."""
    yield from ("", f"# inputs: {', '.join(INPUTS[: network.inputs])}, in SI units", "[network]")
    yield from (f'kind = "{network.kind}"', f"layers = {list(network.layers)}", f"wind = {str(network.wind).lower()}")
    yield from (f"scale = {list(network.scale)}", f"memory = {network.memory}")
    if network.trained:
        yield from (f'weights = "{name}"', f'sha256 = "{network.digest}"')
    if (on := network.limits) is not None:
        yield from ("", "[network.limits]", f"low = {list(map(float, on.low))}", f"high = {list(map(float, on.high))}",
                    f"acceleration = {list(map(float, on.acceleration))}", f"rate = {float(on.rate)!r}")  # fmt: skip


def write_weights(network: Network, path: Path) -> Path:
    """Write the weights to a file of their own, complete, that waits to take the place of the old ones; gives its path.

    It is moved there once the ship file that names its digest is in place; until then a reader finds it as it is.
    """
    return write_whole(_waiting(path, network.digest), packed(**network.weights))


def settle(waiting: Path, path: Path) -> None:
    """Move waiting weights to their place, and clear away those of saves that were cut off before."""
    os.replace(waiting, path)
    for left in path.parent.glob(_waiting(path, "*").name):
        left.unlink(missing_ok=True)


def _waiting(path: Path, digest: str) -> Path:
    return path.with_name(f".{path.stem}-{digest[:16]}.npz")
