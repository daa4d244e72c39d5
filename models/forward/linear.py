"""Forward models: what touches do to a measurement whose noise is white with variance 1.

A solver asks a forward model for the measurement and its derivatives and does not know what was
measured or which theory of plates predicts it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

import fe
from models.arrays import F64, Mask
from models.checks import read_measured
from models.forward.table import ForwardTable, plain_responses, read_touches, responses


class Forward(Protocol):
    """Whitened measurement of m numbers as a function of touches."""

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        ...

    @property
    def freedom(self) -> int:
        """Numbers that were measured, less those that patterns of unknown size use up."""
        ...

    @property
    def model_error(self) -> float:
        """Error of the model itself, a fraction of what is measured."""
        ...

    def own_error(self, touches: F64) -> float:
        """Norm of the model's own error under touches (n, 3), in units of the noise.

        It enters the covariance of touches; 0 where noise alone does, or more than it is known.
        """
        ...

    def whiten(self, measured: ArrayLike) -> F64:
        """Put a measurement into units of its noise, (m,); what is missing may be NaN."""
        ...

    def response(self, xy: F64) -> F64:
        """Measurement per N under a light touch at each place, (n, 2) mm → (n, m)."""
        ...

    def read(self, touches: F64) -> tuple[F64, F64]:
        """Measurement (m,) under touches x, y, F, (n, 3), and its exact derivatives (3n, m)."""
        ...


@dataclass(frozen=True, eq=False)
class LinearForward:
    """A measurement that is linear in the forces.

    Attributes
    ----------
    plate : fe.Plate
    table : ForwardTable
    shape : tuple of int
        Of a measurement before it is whitened.
    model_error : float
        See `Forward.model_error`.
    folded : ForwardTable, optional
        The same table for reading alone, with whitening and patterns set aside put into its values.
    """

    plate: fe.Plate
    table: ForwardTable
    shape: tuple[int, ...]
    model_error: float = 0.0
    folded: ForwardTable | None = None

    @property
    def reading(self) -> ForwardTable:
        """The table that touches are read from."""
        return self.table if self.folded is None else self.folded

    def often(self) -> LinearForward:
        """Return the same for frame after frame: a tenth of the time where channels are whitened.

        It takes as long as reading a place for every node of the plate, and as much memory again.
        """
        table = self.table
        if len(table.whitening) != 1 or self.folded is not None:
            return self
        values = table.values @ table.whitening[0].T
        if len(table.aside):
            values -= (values @ table.aside.T) @ table.aside
        count = values.shape[2]
        whole, none = np.ones((count, 1, 1)), np.empty((0, count))
        return replace(self, folded=table._replace(values=values, whitening=whole, aside=none))

    @property
    def freedom(self) -> int:
        """See `Forward.freedom`."""
        return self._freedom

    @cached_property
    def _freedom(self) -> int:
        return int(self.table.whitening.any(axis=2).sum()) - len(self.table.aside)

    def response(self, xy: F64) -> F64:
        """See `Forward.response`; the same at any force."""
        return plain_responses(self.reading, np.asarray(xy, dtype=np.float64))

    def gradient(self, xy: F64) -> F64:
        """Exact derivative of `response` in x and y, (n, 2) mm → (n, m, 2) per N per mm."""
        return responses(self.reading, np.asarray(xy, dtype=np.float64))[:, 1:].transpose(0, 2, 1)

    def own_error(self, touches: F64) -> float:
        """None: see `Forward.own_error`."""
        return 0.0

    def read(self, touches: F64) -> tuple[F64, F64]:
        """See `Forward.read`."""
        return read_touches(self.reading, touches)

    def whiten(self, measured: ArrayLike) -> F64:
        """Measurement (M, c) in units of its noise, less what lies along patterns set aside, (m,).

        What is missing may be NaN; it comes out as 0.

        Raises
        ------
        ValueError
            If the measurement has another shape than the forward model or is no real numbers.
        """
        whitening, used = self.table.whitening, self._used
        given = read_measured(measured, self.shape).reshape(used.shape)
        there = given if self._whole else np.where(used, given, 0.0)
        if whitening.shape[2] == 1:
            white = (whitening[:, :, 0] * there).ravel()
        else:
            white = np.einsum("gdc,gc->gd", whitening, there).ravel()
        if not len(self.table.aside):
            return white
        return white - (self.table.aside @ white) @ self.table.aside

    @cached_property
    def _used(self) -> Mask:
        """Channels (G, c) that are measured."""
        return np.asarray(self.table.whitening.any(axis=1), dtype=np.bool_)

    @cached_property
    def _whole(self) -> bool:
        return bool(self._used.all())

    def setting_aside(self, patterns: F64) -> LinearForward:
        """Let patterns of unknown size lie over the measurement: bending of the base, say.

        Parameters
        ----------
        patterns : (k, M, c) float64
            In units of the measurement.

        Raises
        ------
        ValueError
            The patterns have another shape, or some are combinations of others.
        """
        whitening = self.table.whitening
        groups, _, channels = whitening.shape
        given = np.asarray(patterns, dtype=np.float64)
        if given.ndim < 2 or given[0].size != groups * channels:
            raise ValueError(
                f"patterns set aside must be (k, {groups}, {channels}) as the measurement, "
                f"got {given.shape}"
            )
        white = np.einsum("gdc,kgc->kgd", whitening, given.reshape(-1, groups, channels))
        columns = np.concatenate([self.table.aside, white.reshape(len(given), -1)]).T
        scale = np.linalg.norm(columns, axis=0)
        values = np.linalg.svd(columns / np.where(scale > 0, scale, 1.0), compute_uv=False)
        if values[-1] <= 1e-9 * values[0]:
            raise ValueError(
                f"{len(given)} patterns set aside must differ from one another in what is "
                "measured; leave out those that others make up"
            )
        aside = np.linalg.qr(columns)[0].T
        return replace(
            self, table=self.table._replace(aside=np.ascontiguousarray(aside)), folded=None
        )

    def weighted(self, weight: F64) -> LinearForward:
        """Trust each measurement by a factor (m,): 0 leaves it out."""
        groups, numbers, _ = self.table.whitening.shape
        whitening = self.table.whitening * weight.reshape(groups, numbers, 1)
        aside = self.table.aside
        if len(aside):
            aside = np.ascontiguousarray(np.linalg.qr((aside * weight).T)[0].T)
        table = self.table._replace(whitening=whitening, aside=aside)
        return replace(self, table=table, folded=None)


def linear(
    plate: fe.Plate,
    mesh: fe.Mesh,
    values: F64,
    whitening: F64,
    shape: tuple[int, ...] | None = None,
) -> LinearForward:
    """Forward model of channels that are functions of the place of a touch.

    Parameters
    ----------
    values : (2 nx + 2, 2 ny + 2, M c) float64, per N
        Unknowns on the mesh.
    whitening : (M, d, c) float64
    shape : tuple of int
        Of a measurement, if not (M, c).
    """
    x, y = mesh.nodes
    count = whitening.shape[0] * whitening.shape[1]
    table = ForwardTable(
        values,
        np.ascontiguousarray(x, dtype=np.float64),
        np.ascontiguousarray(y, dtype=np.float64),
        np.array(mesh.units, dtype=np.float64),
        np.ascontiguousarray(whitening),
        np.empty((0, count)),
    )
    return LinearForward(plate, table, shape or (whitening.shape[0], whitening.shape[2]))


def modal(modes: fe.Modes, factor: F64) -> LinearForward:
    """Forward model of a measurement that was reduced to one number a plate mode, and whitened.

    Parameters
    ----------
    modes : fe.Modes
        K modes of the plate.
    factor : (K, m) float64
        F with response(xy) = modes.response(xy) @ F.
    """
    # modes.response(xy) = -φ(xy) / λ
    return linear(
        modes.plate, modes.mesh, modes.values, (factor / -modes.stiffness[:, None]).T[None]
    )
