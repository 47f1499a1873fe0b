"""Whether Rerun is installed here, which 'make setup' leaves out; and what a file of Rerun's holds."""

from importlib.util import find_spec
from pathlib import Path

import pytest

needs_rerun = pytest.mark.skipif(find_spec("rerun") is None, reason="Rerun is not installed here (make rerun)")


def columns(path: Path) -> dict[str, list[dict[str, object]]]:
    """The rows of a file by entity, each as its filled columns by name, less times of the day; what is said once, too."""
    import pyarrow
    from rerun.chunk import RrdReader

    found: dict[str, list[dict[str, object]]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        kept = [field.name for field in batch.schema if not pyarrow.types.is_timestamp(field.type)]
        for row in batch.select(kept).to_pylist():
            found.setdefault(chunk.entity_path, []).append({name: value for name, value in row.items() if value is not None})
    return found
