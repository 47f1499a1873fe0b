"""How often hand and head are read as what: table 1 and figure 6 of the paper, or tables of another camera, from files."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
import yaml
from deixis_runtime.settings import StageConfig
from deixis_runtime.site import SiteError, read_yaml
from deixis_schemas.codec import say
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from .pointing import GESTURES, REGIONS, PointingGesture, Region

Share = Annotated[float, Field(ge=0, le=1)]
Angle = Annotated[float, Field(ge=0, le=180)]
ROUNDING = 0.005
"""What a column may differ from 1 by: shares of measured tables are rounded."""
MOST_ANGLES = 361


class GestureRow(StageConfig):
    """P(this gesture is recognised | region pointed to)."""

    left: Share
    center: Share
    right: Share


class GestureRows(StageConfig):
    """A row for each gesture recognised."""

    point_left: GestureRow
    invisible: GestureRow
    point_right: GestureRow


class _Table(StageConfig):
    """A file with a table. What else a program has written beside it does not matter."""

    model_config = ConfigDict(extra="ignore")

    source: str = Field(default="", max_length=4096, description="Where the numbers come from, for people.")


class HandConfusion(_Table):
    """Table 1: P(gesture recognised | region pointed to)."""

    table: GestureRows

    def share(self, gesture: PointingGesture, region: Region) -> float:
        """P(gesture | region)."""
        value: float = getattr(getattr(self.table, gesture), region)
        return value

    @model_validator(mode="after")
    def _columns_sum_to_one(self) -> HandConfusion:
        for region in REGIONS:
            total = sum(self.share(gesture, region) for gesture in GESTURES)
            if abs(total - 1) > ROUNDING:
                raise ValueError(f"table: column {region} sums to {total:g}, not to 1")
        return self


class HeadConfusion(_Table):
    """Figure 6: P(perceived yaw | intended yaw), by size, left and right alike; and P(not computed | intended yaw).

    `table` has a row for each of `perceived_deg` with a number for each of `intended_deg`; both begin at 0 and ascend.
    """

    intended_deg: list[Angle] = Field(min_length=2, max_length=MOST_ANGLES)
    perceived_deg: list[Angle] = Field(min_length=2, max_length=MOST_ANGLES)
    table: list[list[Share]] = Field(max_length=MOST_ANGLES)
    not_computed: list[Share] = Field(max_length=MOST_ANGLES)

    @model_validator(mode="after")
    def _is_a_table(self) -> HeadConfusion:
        for name, angles in (("intended_deg", self.intended_deg), ("perceived_deg", self.perceived_deg)):
            if angles[0] != 0 or any(low >= high for low, high in pairwise(angles)):
                raise ValueError(f"{name}: must begin at 0 and ascend")
        if self.intended_deg[-1] != 180:
            raise ValueError("intended_deg: must end at 180")
        columns = len(self.intended_deg)
        if len(self.table) != len(self.perceived_deg) or any(len(row) != columns for row in self.table):
            raise ValueError(f"table: must have {len(self.perceived_deg)} rows of {columns} numbers")
        if len(self.not_computed) != columns:
            raise ValueError(f"not_computed: must have {columns} numbers")
        totals = np.sum([*self.table, self.not_computed], axis=0)
        worst = int(np.argmax(np.abs(totals - 1)))
        if abs(totals[worst] - 1) > ROUNDING:
            raise ValueError(f"table: column {self.intended_deg[worst]:g} sums to {totals[worst]:g}, not to 1")
        return self


T = TypeVar("T", bound=_Table)


@cache
def table_1() -> HandConfusion:
    """The paper's table."""
    return HandConfusion.model_validate(_packaged("table_1.yaml"))


@cache
def fig_6() -> HeadConfusion:
    """The paper's figure, reconstructed: `fitting/reconstruct_fig_6.py`."""
    return HeadConfusion.model_validate(_packaged("fig_6.yaml"))


def load_table(path: Path, model: type[T]) -> T:
    """A table from a YAML or JSON file. Raises ValueError that names the file, and the field."""
    try:
        return model.model_validate(read_yaml(path, "confusion table"))
    except SiteError as error:
        raise ValueError(str(error)) from None
    except ValidationError as error:
        raise ValueError(f"confusion table {path}: {say(error)}") from None


def _packaged(name: str) -> Any:
    return yaml.safe_load(files(__package__).joinpath(name).read_text(encoding="utf-8"))


def _named(model: type[T]) -> Callable[[Any], Any]:
    """A setting may name a file; the table itself does as well."""
    return lambda value: load_table(Path(value), model) if isinstance(value, str) else value


class ConfusionConfig(StageConfig):
    """How often hand and head are read as what."""

    hand: Annotated[HandConfusion, BeforeValidator(_named(HandConfusion))] = Field(
        default_factory=table_1,
        description="Table 1: a YAML or JSON file of the shape of `table_1.yaml`; empty: the paper's.",
    )
    head: Annotated[HeadConfusion, BeforeValidator(_named(HeadConfusion))] = Field(
        default_factory=fig_6, description="paper: figure 6: a file of the shape of `fig_6.yaml`; empty: a reconstruction."
    )
