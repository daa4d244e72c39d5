"""What every section of a scene file has in common."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A table of a scene file: frozen, finite, and closed to keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
