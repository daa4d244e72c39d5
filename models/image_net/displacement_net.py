"""A net of displacement from a file, whichever it is: of tiles or of images."""

from __future__ import annotations

from pathlib import Path

from models.field_net import store as field_store
from models.field_net.field_net import SHIPPED as SHIPPED_FIELD_NET
from models.field_net.store import FieldNet, load_field_net
from models.image_net import store as image_store
from models.image_net.image_net import SHIPPED as SHIPPED_IMAGE_NET
from models.image_net.store import ImageNet, load_image_net
from models.nets.array_file import net_format

SHIPPED_DISPLACEMENT_NETS = {"dic-net": SHIPPED_FIELD_NET, "image-net": SHIPPED_IMAGE_NET}
"""Files of the nets of this package, by the scenes that train them."""

DISPLACEMENT_FORMATS = field_store.FORMAT, image_store.FORMAT
"""What files of such nets say that they hold; see `net_format`."""


def load_displacement_net(path: str | Path) -> FieldNet | ImageNet:
    """Read what `save_field_net` or `save_image_net` wrote.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or a net of something else.
    """
    match net_format(path):
        case field_store.FORMAT:
            return load_field_net(path)
        case image_store.FORMAT:
            return load_image_net(path)
        case other:
            raise ValueError(
                f"net file {path} holds a '{other}', which measures no displacement; name one that "
                "'touchplate train dic-net' or 'touchplate train image-net' wrote"
            )
