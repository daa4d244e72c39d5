"""Public names of `synthetic`: the one list, read by type checkers and by the lazy loader."""

from . import closed_forms as closed_forms
from .batch import (
    BatchWarper as BatchWarper,
    prepare_batch as prepare_batch,
)
from .camera import (
    Camera as Camera,
    pinhole_above as pinhole_above,
    pinhole_below as pinhole_below,
)
from .distortion import Distortion as Distortion
from .exposure import Exposure as Exposure
from .gauges import (
    Gauges as Gauges,
    displacement_gauges as displacement_gauges,
    strain_gauges as strain_gauges,
    texture_at as texture_at,
)
from .light import (
    Light as Light,
    polynomial_light as polynomial_light,
    projected_discs as projected_discs,
)
from .occluder import Occluder as Occluder
from .optics import Optics as Optics
from .pattern import (
    Pattern as Pattern,
    Speckle as Speckle,
    speckle as speckle,
)
from .pose import (
    Face as Face,
    face_height as face_height,
    look_at as look_at,
    rotated as rotated,
)
from .printing import print_pattern as print_pattern
from .rendering import render as render
from .rolling import (
    row_fraction as row_fraction,
    while_read as while_read,
)
from .sensor import Sensor as Sensor
from .telecentric import (
    AnyCamera as AnyCamera,
    Telecentric as Telecentric,
    telecentric_above as telecentric_above,
    telecentric_below as telecentric_below,
)
from .view import (
    image_motion as image_motion,
    image_motion_basis as image_motion_basis,
    rigid_motion_basis as rigid_motion_basis,
)
from .warp import (
    Warper as Warper,
    prepare_warp as prepare_warp,
)
