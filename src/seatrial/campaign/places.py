"""Where the files of a campaign lie: a folder of this machine or of a shared disk, or an object store by its URL.

Every file is whole or absent.  In a folder it is written under a hidden name and renamed; an object store shows an
object once all of it has arrived.  `s3://BUCKET/NAME` and the like go through fsspec, which takes the package of the
store (s3fs, gcsfs, adlfs) and its own configuration and credentials.
"""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from ..core.errors import CampaignError, first_line
from ..core.files import held_alone, write_together
from ..core.values import dataclass

if TYPE_CHECKING:
    import polars as pl

_Found = TypeVar("_Found")

_MARK = "://"
_HERE = ("file", "local")


class Place(Protocol):
    """Files by their names below the place, with ``/`` between folders."""

    @property
    def path(self) -> Path | None:
        """The folder; None of a store."""
        ...

    def __str__(self) -> str: ...

    def read(self, name: str) -> bytes:
        """The bytes of a file; OSError: it cannot be read."""
        ...

    def write(self, files: Mapping[str, bytes]) -> None:
        """Write files in their order, each as a whole; OSError: one cannot be written, and those after it are not."""
        ...

    def find(self, under: str) -> list[str]:
        """Names of the Parquet files below a folder, at any depth."""
        ...

    def holds(self, name: str) -> bool:
        """Whether a file is there."""
        ...

    def used(self) -> bool:
        """Whether anything lies there."""
        ...

    def free(self) -> int | None:
        """Bytes that are free; None where that is not known."""
        ...

    def alone(self, name: str) -> AbstractContextManager[None]:
        """Work alone under a name, where there are locks; BusyError: another process does."""
        ...

    def everywhere(self) -> Place:
        """The same place as other processes find it."""
        ...

    def scan(self, names: Sequence[str]) -> pl.LazyFrame:
        """Parquet files of the same columns as one lazy frame, in this order."""
        ...


def place_of(where: str | Path) -> Place:
    """A folder, or a store by its URL.

    Raises:
        CampaignError: a URL that fsspec does not know, or whose package is missing.
    """
    scheme, mark, rest = str(where).partition(_MARK) if isinstance(where, str) else ("", "", "")
    if not mark:
        return Folder(Path(where))
    if scheme in _HERE:
        return Folder(Path(rest))
    if not rest.strip("/"):
        raise CampaignError(f"{where}: names no bucket; write {scheme}://BUCKET/NAME")
    store = Store(str(where).rstrip("/"))
    store.system()
    return store


@dataclass(frozen=True)
class Folder:
    """A folder of a file system."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    def read(self, name: str) -> bytes:
        return (self.path / name).read_bytes()

    def write(self, files: Mapping[str, bytes]) -> None:
        for name in files:
            (self.path / name).parent.mkdir(parents=True, exist_ok=True)
        write_together({self.path / name: content for name, content in files.items()})

    def find(self, under: str) -> list[str]:
        return [f"{under}/{path.parent.name}/{path.name}" for path in (self.path / under).glob("*/*.parquet")]

    def holds(self, name: str) -> bool:
        return (self.path / name).exists()

    def used(self) -> bool:
        return self.path.exists() and any(path.name[0] != "." for path in self.path.iterdir())

    def free(self) -> int:
        there = next(path for path in (self.path.absolute(), *self.path.absolute().parents) if path.exists())
        return shutil.disk_usage(there).free

    def alone(self, name: str) -> AbstractContextManager[None]:
        return held_alone(self.path / name)

    def everywhere(self) -> Folder:
        return Folder(self.path.resolve())

    def scan(self, names: Sequence[str]) -> pl.LazyFrame:
        import polars as pl

        return pl.scan_parquet([self.path / name for name in names])


@dataclass(frozen=True)
class Store:
    """An object store, or any other file system that fsspec knows and that puts objects as a whole."""

    url: str
    path: None = None

    def __str__(self) -> str:
        return self.url

    def system(self) -> tuple[Any, str]:
        """The file system, which fsspec keeps, and the root in it; CampaignError: there is none."""
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise CampaignError(f"{self.url}: needs fsspec: pip install 'seatrial[cluster]'") from None
        try:
            system, root = url_to_fs(self.url)
        except Exception as error:  # its package is missing, or finds its configuration wrong
            raise CampaignError(f"{self.url}: {first_line(error)}") from None
        return system, str(root).rstrip("/")

    def _asked(self, what: Callable[[Any, str], _Found]) -> _Found:
        """What the store answers; FileNotFoundError: nothing, CampaignError: it cannot be reached or refuses."""
        system, root = self.system()
        try:
            return what(system, root)
        except FileNotFoundError:
            raise
        except Exception as error:  # packages of stores have errors of their own
            if isinstance(error, OSError) and error.errno is not None:
                raise
            wanted = "it takes its bucket, endpoint and credentials from the configuration of its package"
            raise CampaignError(f"{self.url}: {first_line(error)}; {wanted}") from None

    def read(self, name: str) -> bytes:
        return self._asked(lambda system, root: system.cat_file(f"{root}/{name}"))

    def write(self, files: Mapping[str, bytes]) -> None:
        for name, content in files.items():
            try:
                self._asked(lambda system, root: system.pipe_file(f"{root}/{name}", content))  # noqa: B023 -- called at once
            except FileNotFoundError as error:
                said = (str(error).splitlines() or ["no such bucket"])[0]
                raise CampaignError(f"{self.url}: {said[:200]}; make the bucket first") from None

    def find(self, under: str) -> list[str]:
        def look(system: Any, root: str) -> list[str]:
            system.invalidate_cache()
            return list(system.find(f"{root}/{under}"))

        found = self._asked(look)
        return [path[path.rindex(f"{under}/") :] for path in found if path.endswith(".parquet")]

    def holds(self, name: str) -> bool:
        return self._asked(lambda system, root: bool(system.exists(f"{root}/{name}")))

    def used(self) -> bool:
        def look(system: Any, root: str) -> bool:
            system.invalidate_cache()
            return bool(system.ls(root, detail=False))

        try:
            return self._asked(look)
        except FileNotFoundError:
            return False

    def free(self) -> None:
        return None

    def alone(self, name: str) -> AbstractContextManager[None]:
        return nullcontext()

    def everywhere(self) -> Store:
        return self

    def scan(self, names: Sequence[str]) -> pl.LazyFrame:
        import polars as pl
        from polars.io.plugins import register_io_source

        def read(
            columns: list[str] | None, predicate: pl.Expr | None, rows: int | None, size: int | None
        ) -> Iterator[pl.DataFrame]:
            for name in names:
                if rows is not None and rows <= 0:
                    return
                frame = pl.read_parquet(io.BytesIO(self.read(name)), columns=columns, n_rows=rows)
                rows = None if rows is None else rows - frame.height
                yield frame if predicate is None else frame.filter(predicate)

        return register_io_source(read, schema=pl.read_parquet_schema(io.BytesIO(self.read(names[0]))))
