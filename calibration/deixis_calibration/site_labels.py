"""Who pointed at what, from where and when: the labels of a session, as a YAML file beside its recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import yaml
from deixis_runtime.site import SiteError, read_yaml
from deixis_schemas.codec import say
from deixis_schemas.messages import Metre, Name
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

SpotName = Annotated[str, Field(min_length=1, max_length=64)]
Seconds = Annotated[float, Field(ge=0, le=86_400)]


class Labelled(BaseModel):
    """One pointing."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    poi_id: Name
    spot: SpotName
    from_s: Seconds = Field(description="Seconds after the first frame that tracks are there of.")
    to_s: Seconds

    @model_validator(mode="after")
    def _takes_time(self) -> Labelled:
        if self.to_s <= self.from_s:
            raise ValueError("to_s: must be later than from_s")
        return self


class Labels(BaseModel):
    """A session: spots in the map, metres; the person's height from sole to crown, where it is known."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    spots: dict[SpotName, tuple[Metre, Metre]] = Field(min_length=1, max_length=64)
    person_height_m: Annotated[float, Field(ge=0.8, le=2.4)] | None = None
    pointings: list[Labelled] = Field(default_factory=list, max_length=4096)

    @model_validator(mode="after")
    def _spots_are_known(self) -> Labels:
        for number, pointing in enumerate(self.pointings):
            if pointing.spot not in self.spots:
                raise ValueError(f"pointings.{number}.spot: '{pointing.spot}' is none of the spots")
        return self


class LabelsError(ValueError):
    """A labels file that cannot be used; the text names the file and the field."""


def load_labels(path: Path) -> Labels:
    """Read and check. Raises LabelsError."""
    try:
        return Labels.model_validate(read_yaml(path, "labels"))
    except SiteError as error:
        raise LabelsError(str(error)) from None
    except ValidationError as error:
        raise LabelsError(f"labels {path}: {say(error)}") from None


def write_labels(path: Path, labels: Labels) -> None:
    """Write. Raises OSError."""
    path.write_text(yaml.safe_dump(labels.model_dump(mode="json"), sort_keys=False, default_flow_style=None), encoding="utf-8")
