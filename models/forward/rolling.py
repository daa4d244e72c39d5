"""A rolling shutter: an image whose rows are read one after the other, while touches change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

import synthetic
from dic import Tiles
from models.arrays import F64
from models.forward.linear import Forward


@dataclass(frozen=True, eq=False)
class RollingShutter:
    """When the parts of an image are read, s after its middle row.

    Attributes
    ----------
    tiles : (T,) float64, s
    places : (3,) float64, s, s/mm, s/mm
        Of a place (x, y) of the plate, as a sum of these times 1, x and y.
    """

    tiles: F64
    places: F64

    def read_at(self, xy: F64) -> F64:
        """When the rows of places (n, 2) mm are read, (n,) s."""
        return read_at(self.places, xy)


class Rolled(NamedTuple):
    """What a change of the plate while it is read leaves in a measurement.

    Attributes
    ----------
    reading : (m, K) float64
        By a change of each of K measured fields, a second.
    places : (3,) float64
        See `RollingShutter`.
    """

    reading: F64
    places: F64


@runtime_checkable
class RollingFields(Protocol):
    """Fields of a plate whose touches may change while an image is read."""

    def rolling_forward(self, factor: F64, rolled: Rolled) -> Forward:
        """Forward model of amplitudes whitened by a factor, and of their change."""
        ...


def read_at(places: F64, xy: F64) -> F64:
    """When the rows of places (n, 2) mm are read, (n,) s; see `RollingShutter`."""
    return places[0] + xy @ places[1:]


def rolling_shutter(
    camera: synthetic.AnyCamera, height: float, tiles: Tiles, row_time: float
) -> RollingShutter:
    """Say when a camera reads its tiles and the plate.

    Parameters
    ----------
    camera : synthetic.AnyCamera
    height : float, mm
        Of the seen face over the plate's middle plane.
    tiles : Tiles
    row_time : float, s
        From the reading of a row to that of the next.
    """
    late = row_time * (tiles.xy[:, 1] - (camera.size[1] - 1) / 2)
    seen = np.column_stack([np.ones(len(late)), camera.on_plate(tiles.xy, height)])
    places = np.asarray(np.linalg.lstsq(seen, late, rcond=None)[0], dtype=np.float64)
    return RollingShutter(late, places)
