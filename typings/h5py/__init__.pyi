"""What the project uses of h5py, which states no types."""

from collections.abc import Callable, ItemsView, Iterator, MutableMapping
from io import RawIOBase
from os import PathLike
from types import TracebackType
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from h5py import h5d as h5d, h5p as h5p
from numpy.typing import ArrayLike, DTypeLike

class StoreInfo(NamedTuple):
    chunk_offset: tuple[int, ...]
    filter_mask: int
    byte_offset: int | None
    size: int

class DatasetID:
    def get_offset(self) -> int | None: ...
    def get_chunk_info_by_coord(self, coord: tuple[int, ...]) -> StoreInfo: ...
    def write_direct_chunk(self, offsets: tuple[int, ...], data: bytes) -> None: ...

class Dataset:
    attrs: MutableMapping[str, Any]
    dtype: np.dtype[Any]
    id: DatasetID
    name: str
    ndim: int
    shape: tuple[int, ...]
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Any]: ...
    def __getitem__(self, key: Any) -> Any: ...
    def __setitem__(self, key: Any, value: ArrayLike) -> None: ...
    def __array__(self, dtype: Any = None, copy: bool | None = True) -> np.ndarray[Any, Any]: ...
    def flush(self) -> None: ...
    def resize(self, size: int | tuple[int, ...], axis: int | None = None) -> None: ...

class Group:
    attrs: MutableMapping[str, Any]
    def __contains__(self, name: str) -> bool: ...
    def __getitem__(self, name: str) -> Dataset: ...
    def __setitem__(self, name: str, value: ArrayLike) -> None: ...
    def create_dataset(
        self,
        name: str,
        shape: tuple[int, ...] | None = None,
        dtype: DTypeLike | None = None,
        data: ArrayLike | None = None,
        *,
        chunks: tuple[int, ...] | bool | None = None,
        compression: str | int | None = None,
        dcpl: h5p.PropDCID | None = None,
        fillvalue: float | None = None,
        maxshape: tuple[int | None, ...] | None = None,
        shuffle: bool | None = None,
    ) -> Dataset: ...
    def items(self) -> ItemsView[str, Dataset | Group]: ...
    def visititems(self, func: Callable[[str, Dataset | Group], object]) -> object: ...

def string_dtype(encoding: str = "utf-8", length: int | None = None) -> np.dtype[Any]: ...

class File(Group):
    swmr_mode: bool
    def __init__(
        self,
        name: str | PathLike[str] | RawIOBase,
        mode: Literal["r", "r+", "w", "x", "a"] = "r",
        *,
        libver: Literal["earliest", "latest"] | None = None,
        swmr: bool = False,
    ) -> None: ...
    def __enter__(self) -> Self: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...
    def close(self) -> None: ...
    def flush(self) -> None: ...
