"""POIs from a file: a site file, a YAML or JSON list, CSV, or GeoJSON in metres of the map."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from deixis_schemas.codec import say
from pydantic import ValidationError

from .site import MAX_SITE_BYTES, Site, SiteError, SitePoi, load_site, load_yaml

CSV_COLUMNS = ("poi_id", "x_m", "y_m", "z_m")
CSV_OPTIONAL = ("name", "extent_m", "tags")
GEOJSON_PROPERTIES = ("poi_id", "name", "extent_m", "tags")


def load_pois(path: Path) -> list[SitePoi]:
    """The POIs of a file, by its ending: .csv, .geojson, else YAML or JSON: a site file, a list of POIs or GeoJSON.

    Raises SiteError with file, field and cause; CSV is named by its line, GeoJSON by its feature.
    """
    ending = path.suffix.lower()
    if ending == ".csv":
        return _checked(path, _from_csv(path))
    content = _load_json(path) if ending == ".geojson" else load_yaml(path, "POI file")
    if isinstance(content, dict) and ("features" in content or ending == ".geojson"):
        return _checked(path, _from_geojson(path, content))
    if isinstance(content, dict):
        return load_site(path).pois
    return _checked(path, content or [])


def _checked(path: Path, pois: Any) -> list[SitePoi]:
    try:
        return Site.model_validate({"pois": pois}).pois
    except ValidationError as error:
        raise SiteError(f"POI file {path}: {say(error)}") from None


# --- CSV --------------------------------------------------------------------------------------------------------------


def _from_csv(path: Path) -> list[dict[str, Any]]:
    """Rows with a header; tags are parted by `;`, and an empty cell is as if its column were not there.

    A cell of several lines is read as one.
    """
    reader = csv.DictReader(io.StringIO(_read(path), newline=""), strict=True)
    try:
        columns = reader.fieldnames or []
        _check_columns(path, list(columns))
        return [_of_row(path, reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise SiteError(f"POI file {path}: line {reader.line_num}: not CSV: {error}") from None


def _check_columns(path: Path, columns: list[str]) -> None:
    for name in CSV_COLUMNS:
        if name not in columns:
            named = ", ".join(CSV_COLUMNS + CSV_OPTIONAL)
            raise SiteError(f"POI file {path}: no column '{name}'; the first line names {named}, parted by commas")
    for name in columns:
        if name not in CSV_COLUMNS + CSV_OPTIONAL or columns.count(name) > 1:
            raise SiteError(f"POI file {path}: column '{name[:40]}' is unknown or stands twice")


def _of_row(path: Path, line: int, row: dict[str | None, Any]) -> dict[str, Any]:
    if None in row or None in row.values():
        raise SiteError(f"POI file {path}: line {line}: not as many cells as the first line has")
    given = {str(name): " ".join(text.split()) for name, text in row.items() if text.strip()}
    where = f"POI file {path}: line {line}"
    poi: dict[str, Any] = {name: given[name] for name in ("poi_id", "name") if name in given}
    poi["position_m"] = [_number(where, name, given.get(name, "")) for name in CSV_COLUMNS[1:]]
    if "extent_m" in given:
        poi["extent_m"] = _number(where, "extent_m", given["extent_m"])
    poi["tags"] = [tag.strip() for tag in given.get("tags", "").split(";") if tag.strip()]
    return poi


def _number(where: str, name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SiteError(f"{where}: {name}: '{text[:40]}' is not a number") from None


# --- GeoJSON ----------------------------------------------------------------------------------------------------------


def _from_geojson(path: Path, content: dict[str, Any]) -> list[dict[str, Any]]:
    """Features that are points; coordinates are metres in the map frame, x, y and z, not degrees on the earth.

    The id is a feature's `id` or its property `poi_id`. Properties that are not ours are left alone: tools add their own.
    """
    where = f"POI file {path}"
    if content.get("type") != "FeatureCollection" or not isinstance(content.get("features"), list):
        raise SiteError(f"{where}: not a GeoJSON FeatureCollection")
    if "crs" in content and "local" not in json.dumps(content["crs"]).lower():
        raise SiteError(f"{where}: crs: coordinates are metres in the map frame, so there is none, or one that is called local")
    return [_of_feature(f"{where}: feature {i}", feature) for i, feature in enumerate(content["features"])]


def _of_feature(where: str, feature: Any) -> dict[str, Any]:
    if not isinstance(feature, dict) or feature.get("type") != "Feature" or not isinstance(feature.get("geometry"), dict):
        raise SiteError(f"{where}: not a Feature with a geometry")
    geometry, properties = feature["geometry"], feature.get("properties") or {}
    if geometry.get("type") != "Point":
        raise SiteError(f"{where}: geometry {str(geometry.get('type'))[:40]}: a POI is a Point, its size the property extent_m")
    if not isinstance(properties, dict):
        raise SiteError(f"{where}: properties: not an object")
    place = geometry.get("coordinates")
    if not isinstance(place, list) or len(place) != 3:
        raise SiteError(f"{where}: coordinates: x, y and z are wanted, metres in the map frame; z is the height")
    poi = {name: properties[name] for name in GEOJSON_PROPERTIES if properties.get(name) is not None}
    if "poi_id" not in poi and feature.get("id") is not None:
        poi["poi_id"] = str(feature["id"])
    return poi | {"position_m": place}


# --- files ------------------------------------------------------------------------------------------------------------


def _load_json(path: Path) -> Any:
    try:
        return json.loads(_read(path))
    except (ValueError, RecursionError) as error:
        raise SiteError(f"POI file {path}: not JSON: {error}") from None


def _read(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_SITE_BYTES:
            raise SiteError(f"POI file {path}: larger than {MAX_SITE_BYTES} bytes")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SiteError(f"POI file {path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SiteError(f"POI file {path}: not UTF-8: {error}") from None
