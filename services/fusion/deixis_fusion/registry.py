"""The POI registry: a SQLite file. What was acknowledged is on disk, whatever kills the process next."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from pathlib import Path

from deixis_schemas.codec import CodecError, decode_json
from deixis_schemas.messages import MAX_POIS, Poi

FORMAT = 1
BUSY_MS = 500

SCHEMA = """
CREATE TABLE pois (poi_id TEXT PRIMARY KEY, content TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE baseline (poi_id TEXT PRIMARY KEY, content TEXT NOT NULL) WITHOUT ROWID;
"""


class RegistryError(Exception):
    """The file cannot be used, or an edit cannot be done; the text names the file or the field."""


class Registry:
    """POIs by id, kept in memory and on disk.

    Every edit is one transaction, committed and synced to disk before the call returns (write-ahead log, synchronous=FULL). The
    file is locked as long as it is open: two registries on one file would each answer from a memory that the other does
    not see.
    """

    def __init__(self, path: Path) -> None:
        """Open the file, or make it with its folder. Raises RegistryError where that fails."""
        self.path = path
        self._pois: dict[str, Poi] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(path, timeout=BUSY_MS / 1000, isolation_level=None)
        except (OSError, sqlite3.Error) as error:
            raise RegistryError(f"registry {path}: cannot be opened: {error}") from None
        try:
            self._prepare()
            self._pois = self._load()
        except sqlite3.Error as error:
            self._db.close()
            raise RegistryError(f"registry {path}: {_cause(error)}") from None
        except RegistryError:
            self._db.close()
            raise

    def pois(self) -> list[Poi]:
        """All POIs, by id."""
        return [self._pois[poi_id] for poi_id in sorted(self._pois)]

    def get(self, poi_id: str) -> Poi | None:
        """The POI of that id."""
        return self._pois.get(poi_id)

    def put(self, poi: Poi) -> None:
        """Add or replace a POI; on disk when this returns. Raises RegistryError."""
        if poi.poi_id not in self._pois and len(self._pois) >= MAX_POIS:
            raise RegistryError(f"poi_id: the registry is full, it holds {MAX_POIS} POIs")
        self._commit([("INSERT OR REPLACE INTO pois VALUES (?, ?)", (poi.poi_id, poi.model_dump_json()))])
        self._pois[poi.poi_id] = poi

    def delete(self, poi_id: str) -> Poi:
        """Remove a POI; gone from disk when this returns. Returns what it was. Raises RegistryError for an unknown id."""
        poi = self._pois.get(poi_id)
        if poi is None:
            raise RegistryError(f"poi_id: there is no POI '{poi_id}'")
        self._commit([("DELETE FROM pois WHERE poi_id = ?", (poi_id,))])
        del self._pois[poi_id]
        return poi

    def apply_site(self, site: Sequence[Poi]) -> list[str]:
        """Apply what changed in the site file since it was last applied; returns the ids touched.

        Entries that are new, changed or gone since then are put or deleted; an operator's edits to the others persist, also the
        deletion of an entry that the site file still has. Raises RegistryError.
        """
        # A site's own kind of Poi equals no stored one: compare plain ones.
        wanted = {poi.poi_id: Poi.model_validate(poi.model_dump()) for poi in site}
        applied = self._baseline()
        changed = [poi_id for poi_id, poi in wanted.items() if applied.get(poi_id) != poi]
        gone = [poi_id for poi_id in applied if poi_id not in wanted]
        after = (set(self._pois) | set(changed)) - set(gone)
        if len(after) > MAX_POIS:
            raise RegistryError(f"registry {self.path}: with the site's POIs it would hold {len(after)}, at most {MAX_POIS}")
        statements: list[tuple[str, tuple[str, ...]]] = []
        for poi_id in changed:
            content = wanted[poi_id].model_dump_json()
            statements += [
                (f"INSERT OR REPLACE INTO {table} VALUES (?, ?)", (poi_id, content)) for table in ("pois", "baseline")
            ]
        for poi_id in gone:
            statements += [(f"DELETE FROM {table} WHERE poi_id = ?", (poi_id,)) for table in ("pois", "baseline")]
        self._commit(statements)
        self._pois.update({poi_id: wanted[poi_id] for poi_id in changed})
        for poi_id in gone:
            self._pois.pop(poi_id, None)
        return sorted(changed + gone)

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def _prepare(self) -> None:
        # Exclusive first: WAL then needs no shared-memory file, and a second process is refused at once.
        self._db.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = FULL")
        self._db.execute("BEGIN IMMEDIATE")
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        (tables,) = self._db.execute("SELECT count(*) FROM sqlite_master WHERE type = 'table'").fetchone()
        if version == 0 and tables == 0:
            for statement in filter(str.strip, SCHEMA.split(";")):
                self._db.execute(statement)
            self._db.execute(f"PRAGMA user_version = {FORMAT}")
        self._db.execute("COMMIT")
        if version == 0 and tables > 0:
            raise RegistryError(f"registry {self.path}: is a database of something else")
        if version not in (0, FORMAT):
            raise RegistryError(f"registry {self.path}: has format {version}, this version of Deixis knows {FORMAT}")

    def _load(self) -> dict[str, Poi]:
        (verdict,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise RegistryError(f"registry {self.path}: is corrupt: {verdict}")
        return self._read("SELECT poi_id, content FROM pois")

    def _baseline(self) -> dict[str, Poi]:
        try:
            return self._read("SELECT poi_id, content FROM baseline")
        except sqlite3.Error as error:
            raise RegistryError(f"registry {self.path}: {_cause(error)}") from None

    def _read(self, query: str) -> dict[str, Poi]:
        pois = {}
        for poi_id, content in self._db.execute(query):
            try:
                pois[poi_id] = decode_json(Poi, content)
            except (CodecError, TypeError) as error:
                raise RegistryError(f"registry {self.path}: the entry '{poi_id}' is corrupt: {error}") from None
        return pois

    def _commit(self, statements: Sequence[tuple[str, tuple[str, ...]]]) -> None:
        """Run these as one transaction. Raises RegistryError, and then nothing is changed."""
        try:
            self._db.execute("BEGIN IMMEDIATE")
            for statement, values in statements:
                self._db.execute(statement, values)
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise RegistryError(f"registry {self.path}: not written: {_cause(error)}") from None


def _cause(error: sqlite3.Error) -> str:
    text = str(error)
    if "locked" in text or "busy" in text:
        return "is locked by another process; is another fusion stage running on it?"
    if "not a database" in text or "malformed" in text:
        return f"is corrupt: {text}"
    return text
