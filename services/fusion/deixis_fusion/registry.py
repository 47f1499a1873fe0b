"""The POI registry: a SQLite file. What was acknowledged is on disk, whatever kills the process next."""

from __future__ import annotations

import hashlib
import os
import re
import sqlite3
import tempfile
from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from deixis_schemas.codec import CodecError, decode_json, parse_json, validate
from deixis_schemas.messages import MAX_REGISTERED, NAME_PATTERN, Poi
from deixis_schemas.plain_text import cleaned, shown

FORMAT = 1
BUSY_MS = 500
MEMORY = ":memory:"
BY_SITE = "site file"
UNEDITED = {"edited_by": "", "edited_ns": 0}

SCHEMA = """
CREATE TABLE pois (poi_id TEXT PRIMARY KEY, content TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE baseline (poi_id TEXT PRIMARY KEY, content TEXT NOT NULL) WITHOUT ROWID;
"""


class RegistryError(Exception):
    """The file cannot be used, or an edit cannot be done; the text names the file or the field."""


class CorruptError(RegistryError):
    """What the file holds is damaged."""


@dataclass(frozen=True)
class Put:
    """Adds or replaces a POI."""

    poi: Poi


@dataclass(frozen=True)
class Delete:
    """Removes the POI of that id."""

    poi_id: str


Change = Put | Delete
Statement = tuple[str, tuple[str, ...]]


class Registry:
    """POIs by id, kept in memory and on disk.

    Every call that edits is one transaction, committed and synced to disk before it returns (write-ahead log,
    synchronous=FULL). The file is locked as long as it is open: two registries on one file would each answer from a memory
    that the other does not see.
    """

    def __init__(self, path: Path | None) -> None:
        """Open the file, or make it with its folder; without a path, in memory. Raises RegistryError where that fails."""
        self.path = path or MEMORY
        self._pois: dict[str, Poi] = {}
        self._listed: list[Poi] = []
        self._copied = False
        try:
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(self.path, timeout=BUSY_MS / 1000, isolation_level=None)
        except (OSError, sqlite3.Error) as error:
            raise RegistryError(f"registry {self.path}: cannot be opened: {_cause(error, self.path)}") from None
        try:
            self._prepare()
            self._pois = self._load()
        except sqlite3.Error as error:
            self._db.close()
            kind = CorruptError if _is_damage(error) else RegistryError
            raise kind(f"registry {self.path}: {_cause(error, self.path)}") from None
        except RegistryError:
            self._db.close()
            raise

    def pois(self) -> list[Poi]:
        """All POIs, by id."""
        # Listed once and not for each get: thousands take milliseconds.
        if not self._listed:
            self._listed = [self._pois[poi_id] for poi_id in sorted(self._pois)]
        return list(self._listed)

    def get(self, poi_id: str) -> Poi | None:
        """The POI of that id."""
        return self._pois.get(poi_id)

    def apply(self, changes: Sequence[Change], *, all_or_none: bool = False) -> list[Poi | RegistryError]:
        """Make these changes in their order, as one transaction; on disk when this returns.

        Returns for each the POI as it is, or as it was where it is deleted; or why it is refused, as all are where the disk
        refuses. With `all_or_none` the first refusal is raised as RegistryError, and nothing is changed.
        """
        after, statements, results = dict(self._pois), list[Statement](), list[Poi | RegistryError]()
        for change in changes:
            try:
                result, statement = _put(after, change.poi) if isinstance(change, Put) else _delete(after, change.poi_id)
            except RegistryError as error:
                if all_or_none:
                    raise
                results.append(error)
            else:
                results.append(result)
                statements.append(statement)
        if not statements:
            return results
        try:
            self._commit(statements)
        except RegistryError as error:
            if all_or_none:
                raise
            return [error] * len(results)
        self._pois = after
        self._listed = []
        return results

    def put(self, poi: Poi) -> None:
        """Add or replace a POI; on disk when this returns. Raises RegistryError."""
        self._apply_one(Put(poi))

    def delete(self, poi_id: str) -> Poi:
        """Remove a POI; gone from disk when this returns. Returns what it was. Raises RegistryError for an unknown id."""
        return self._apply_one(Delete(poi_id))

    def apply_site(self, site: Sequence[Poi], now_ns: int = 0) -> list[str]:
        """Apply what changed in the site file since it was last applied; returns the ids touched.

        Entries that are new, changed or gone since then are put or deleted; an operator's edits to the others persist, also the
        deletion of an entry that the site file still has. `now_ns` is when. Raises RegistryError.
        """
        # A site's own kind of Poi equals no stored one: compare plain ones.
        wanted = {poi.poi_id: Poi.model_validate(poi.model_dump() | UNEDITED) for poi in site}
        applied = self._baseline()
        changed = [poi_id for poi_id, poi in wanted.items() if applied.get(poi_id) != poi]
        gone = [poi_id for poi_id in applied if poi_id not in wanted]
        after = (set(self._pois) | set(changed)) - set(gone)
        if len(after) > MAX_REGISTERED:
            would = f"with the site's POIs it would hold {len(after)}, at most {MAX_REGISTERED}"
            raise RegistryError(f"registry {self.path}: {would}")
        stored = {i: wanted[i].model_copy(update={"edited_by": BY_SITE, "edited_ns": now_ns}) for i in changed}
        statements: list[Statement] = []
        for poi_id in changed:
            for table, poi in (("pois", stored[poi_id]), ("baseline", wanted[poi_id])):
                statements.append((f"INSERT OR REPLACE INTO {table} VALUES (?, ?)", (poi_id, poi.model_dump_json())))
        for poi_id in gone:
            statements += [(f"DELETE FROM {table} WHERE poi_id = ?", (poi_id,)) for table in ("pois", "baseline")]
        self._commit(statements)
        self._pois.update(stored)
        for poi_id in gone:
            self._pois.pop(poi_id, None)
        self._listed = []
        return sorted(changed + gone)

    def keep_copy(self) -> None:
        """Copy the file, found sound, beside itself where it has changed since the last copy. Raises RegistryError."""
        if self._copied or not isinstance(self.path, Path):
            return
        good = copy_of(self.path)
        fresh = good.with_name(good.name + ".fresh")
        try:
            fresh.unlink(missing_ok=True)
            with closing(sqlite3.connect(fresh, isolation_level=None)) as copy:
                self._db.backup(copy)
                (verdict,) = copy.execute("PRAGMA quick_check(1)").fetchone()
            if verdict != "ok":
                raise CorruptError(f"registry {self.path}: no copy kept, it has become corrupt: {verdict}")
            with fresh.open("rb") as written:
                os.fsync(written.fileno())
            fresh.replace(good)
        except (OSError, sqlite3.Error) as error:
            raise RegistryError(f"registry {self.path}: no copy kept: {_cause(error, self.path)}") from None
        finally:
            # On a full disk what there is of it is room that the registry itself needs.
            with suppress(OSError):
                fresh.unlink(missing_ok=True)
        self._copied = True

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def _apply_one(self, change: Change) -> Poi:
        (result,) = self.apply([change])
        if isinstance(result, RegistryError):
            raise result
        return result

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
            raise CorruptError(f"registry {self.path}: is corrupt: {' '.join(verdict.split())}")
        self._read("SELECT poi_id, content FROM baseline")
        return self._read("SELECT poi_id, content FROM pois")

    def _baseline(self) -> dict[str, Poi]:
        try:
            return self._read("SELECT poi_id, content FROM baseline")
        except sqlite3.Error as error:
            raise RegistryError(f"registry {self.path}: {_cause(error, self.path)}") from None

    def _read(self, query: str) -> dict[str, Poi]:
        pois = {}
        for poi_id, content in self._db.execute(query):
            try:
                pois[poi_id] = _stored(content)
            except (CodecError, TypeError) as error:
                raise CorruptError(f"registry {self.path}: the entry '{poi_id}' is corrupt: {error}") from None
            if pois[poi_id].poi_id != poi_id:
                raise CorruptError(
                    f"registry {self.path}: the entry '{poi_id}' is corrupt: it is that of '{pois[poi_id].poi_id}'"
                )
        return pois

    def _commit(self, statements: Sequence[Statement]) -> None:
        """Run these as one transaction. Raises RegistryError, and then nothing is changed."""
        try:
            self._db.execute("BEGIN IMMEDIATE")
            for statement, values in statements:
                self._db.execute(statement, values)
            self._db.execute("COMMIT")
            self._copied = False
        except sqlite3.Error as error:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise RegistryError(f"registry {self.path}: not written: {_cause(error, self.path)}") from None


def default_path(robot: str, site: Path) -> Path:
    """Where the registry is when no setting says so: one file for each robot and site file, in the user's state folder.

    By the XDG base directories. Raises RegistryError for a robot whose name is none.
    """
    # Names are checked where they are given; a part of a path is checked where it becomes one.
    if not re.fullmatch(NAME_PATTERN, robot):
        raise RegistryError(f"registry: the robot's name '{robot[:80]}' cannot name a folder")
    base = os.environ.get("XDG_STATE_HOME") or ""
    state = Path(base) if os.path.isabs(base) else Path.home() / ".local" / "state"
    resolved = site.resolve()
    digest = hashlib.sha256(str(resolved).encode()).hexdigest()[:8]
    return state / "deixis" / robot / f"{resolved.stem}-{digest}.sqlite"


def _stored(content: str) -> Poi:
    """The POI of an entry. Raises CodecError.

    Names that an earlier version took may hold control characters: they are read as spaces, for that is no damage.
    """
    try:
        return decode_json(Poi, content)
    except CodecError:
        fields = parse_json(content)
        for name in ("name", "edited_by"):
            fields[name] = cleaned(str(fields.get(name, "")))
        fields["tags"] = [cleaned(str(tag)) for tag in fields.get("tags", ())]
        return validate(Poi, fields)


def _put(pois: dict[str, Poi], poi: Poi) -> tuple[Poi, Statement]:
    if poi.poi_id not in pois and len(pois) >= MAX_REGISTERED:
        raise RegistryError(f"poi_id: the registry is full, it holds {MAX_REGISTERED} POIs")
    pois[poi.poi_id] = poi
    return poi, ("INSERT OR REPLACE INTO pois VALUES (?, ?)", (poi.poi_id, poi.model_dump_json()))


def _delete(pois: dict[str, Poi], poi_id: str) -> tuple[Poi, Statement]:
    if poi_id not in pois:
        raise RegistryError(f"poi_id: there is no POI '{shown(poi_id[:80])}'")
    return pois.pop(poi_id), ("DELETE FROM pois WHERE poi_id = ?", (poi_id,))


def _cause(error: OSError | sqlite3.Error, path: Path | str) -> str:
    text = str(error)
    if isinstance(error, OSError):
        return text
    if "locked" in text or "busy" in text:
        return "is locked by another process; is another fusion stage running on it?"
    if _is_damage(error):
        return f"is corrupt: {text}"
    # SQLite keeps to itself what the system told it; a file beside it is told the same.
    refused = _refuses_files(path.parent) if isinstance(path, Path) else ""
    return f"{text} ({refused})" if refused else text


def _refuses_files(folder: Path) -> str:
    """Why no file can be written in a folder; empty if one can. Never by the registry's own file: to close it ends the lock."""
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as tried:
            tried.write(bytes(4096))
    except OSError as error:
        return f"{folder}: {error.strerror or error}"
    return ""


def _is_damage(error: sqlite3.Error) -> bool:
    return any(word in str(error) for word in ("not a database", "malformed", "Could not decode", "no such table"))


def copy_of(path: Path) -> Path:
    """Where the last good copy of a registry is."""
    return path.with_name(path.name + ".good")
