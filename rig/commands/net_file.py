"""The file of a net of arrays that a command is asked for."""

from __future__ import annotations

from pathlib import Path

from rig.training.data import model_path

_SHIPPED = "dic-net", "image-net", "touch-net"  # scenes whose nets come with the package


def net_file(model: str) -> Path | None:
    """Return the .npz that a name or a path means; None where it is a model or a recording.

    A scene that was not trained here means the net of the package.
    """
    path = Path(model)
    if path.suffix == ".npz":
        return path
    if path.suffix not in ("", ".toml"):
        return None
    trained = model_path(model).with_suffix(".npz")
    if trained.is_file():
        return trained
    if model not in _SHIPPED:
        return None
    from models import SHIPPED_DISPLACEMENT_NETS, SHIPPED_TOUCH_NET

    return SHIPPED_DISPLACEMENT_NETS.get(model, SHIPPED_TOUCH_NET)
