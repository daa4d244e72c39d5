"""Sections for where frames come from: the twin, a camera, or images that were kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from rig.scene.departure import DepartureSection
from rig.scene.quantity import Count, Kelvin, Pixels, Ratio, Speed, Time, TurningSpeed
from rig.scene.section import Section

if TYPE_CHECKING:
    from rig.camera.controls import Controls

Text = Annotated[str, Field(min_length=1)]


class TwinSection(Section):
    """The digital twin: images are rendered, so the truth is known."""

    kind: Literal["twin"] = Field("twin", description="where frames come from")
    script: Literal[
        "tour",
        "random",
        "letters",
        "collect",
        "weights",
        "melody",
        "presses",
        "taps",
        "empty",
        "board",
        "board-on-plate",
    ] = Field(
        "tour",
        description="touches: a tour of moves and presses, random ones, a finger that writes,"
        " known presses, weights laid one beside the other, a melody on keys, presses that rest,"
        " taps of a knuckle, or none;"
        " or the board of a calibration, held before the camera or lying on the plate",
    )
    text: Text = Field("TOUCH", description="what the script 'letters' writes, A to Z")
    pace: Ratio = Field(
        0.35, gt=0, le=10, description="of the plate's side that it writes in a second"
    )
    seed: Count = Field(0, ge=0, description="seed of noise and random touches")
    shift: tuple[Pixels, Pixels] = Field(
        (0.0, 0.0), description="shift of the camera after the reference, x and y, px"
    )
    shape: Count = Field(
        1,
        ge=1,
        description="which of the stable shapes of [base] the plate has: by energy, of equal ones"
        " that which bows up most comes first",
    )
    bend_speed: Speed = Field(
        0.0, description="at which the clamps come nearer for half a minute, and then go back, mm/s"
    )
    twist_speed: TurningSpeed = Field(
        0.0, description="at which they turn against each other meanwhile, deg/s"
    )
    rings: bool = Field(
        False,
        strict=True,
        description="whether its plate rings, with the density and damping of [dynamics]; else it"
        " is at equilibrium in every frame",
    )
    departure: DepartureSection | None = Field(
        None, description="how its bench differs from what the scene says [in nothing]"
    )


class DeviceSection(Section):
    """A camera, whose controls are held still; [camera] says its size and rate."""

    exposure: Time | None = Field(None, gt=0, description="exposure, s [as the camera found it]")
    gain: Ratio | None = Field(None, description="gain, steps of the camera [as found]")
    focus: Ratio | None = Field(None, description="focus, steps of the camera [as found]")
    white_balance: Kelvin | None = Field(None, gt=0, description="white balance, K [as found]")

    def controls(self) -> Controls:
        """Return what is held still, as `rig.camera` knows it."""
        from rig.camera.controls import Controls

        return Controls(self.exposure, self.gain, self.focus, self.white_balance)


class OpenCv(DeviceSection):
    """A camera at a device node, through OpenCV: any UVC camera."""

    kind: Literal["opencv"] = Field(description="where frames come from")
    device: Text = Field(
        "/dev/video0", description="device node; on Windows and macOS the camera's number"
    )


class V4l2(DeviceSection):
    """The same through the kernel itself, which numbers its frames (needs linuxpy)."""

    kind: Literal["v4l2"] = Field(description="where frames come from")
    device: Text = Field("/dev/video0", description="device node")


class MachineVision(DeviceSection):
    """A camera with inputs, known by its serial number."""

    serial: Text = Field(description="serial number")
    trigger: Text | None = Field(
        None,
        description="input whose rising edge takes each frame, such as Line1; the pulses come at"
        " the rate of [camera], say from a board with board.trigger_width [it runs by itself]",
    )


class Basler(MachineVision):
    """A Basler camera (needs pypylon)."""

    kind: Literal["basler"] = Field(description="where frames come from")


class Genicam(MachineVision):
    """A GenICam camera through the GenTL producer of its maker (needs harvesters)."""

    kind: Literal["genicam"] = Field(description="where frames come from")
    producer: Text = Field(description="the maker's file *.cti")


class Folder(Section):
    """Images of a folder in the order of their numbers, at the rate of [camera]."""

    kind: Literal["folder"] = Field(description="where frames come from")
    path: Text = Field(description="folder of grey images of 8 bit")


class Files(Section):
    """Images of any names, at the rate of [camera] or at the times when they were taken."""

    kind: Literal["files"] = Field(description="where frames come from")
    path: Text = Field(description="their names, with * and ?, in the order of their numbers")
    times: Text | None = Field(
        None, description="CSV file with the time of each, s [at the rate of [camera]]"
    )


class Video(Section):
    """Images of a video, at the rate of [camera]."""

    kind: Literal["video"] = Field(description="where frames come from")
    path: Text = Field(description="file that OpenCV reads")


class Recorded(Section):
    """Images, reference and truth of a recorded session, at the pace of that time."""

    kind: Literal["recording"] = Field(description="where frames come from")
    path: Text = Field(description="file *.h5 that was recorded")


Source = Annotated[
    TwinSection | OpenCv | V4l2 | Basler | Genicam | Folder | Files | Video | Recorded,
    Field(discriminator="kind"),
]
