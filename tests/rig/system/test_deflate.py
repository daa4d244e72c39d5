"""Chunks that are compressed here are read by HDF5 as its own."""

import h5py
import numpy as np
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from rig.system.deflate import deflate, shuffle

SHAPES = hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)


@given(st.data())
def test_hdf5_reads_what_is_compressed_here(data):
    kind = data.draw(st.sampled_from([np.int8, np.uint16, np.float32, np.float64]))
    values = data.draw(hnp.arrays(kind, SHAPES))
    with h5py.File("kept", "w", driver="core", backing_store=False) as file:
        kept = file.create_dataset(
            "values", values.shape, kind, chunks=values.shape, compression="gzip", shuffle=True
        )
        kept.id.write_direct_chunk((0, 0), deflate(shuffle(values)))
        np.testing.assert_array_equal(kept[...], values)
