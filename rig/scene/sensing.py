"""Sections for what is computed: correlation, estimators and their training."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import Angle, Count, Force, Length, Pixels, Ratio, odd
from rig.scene.section import Section


class DicSection(Section):
    """Correlation of each frame with the reference."""

    tile: Count = Field(16, ge=4, le=64, description="side of the tiles whose sums are kept, px")
    subset: Count = Field(
        49,
        ge=5,
        le=999,
        description="side of the window that gives one displacement of the map, px, odd",
    )
    window: Count = Field(
        5, ge=3, le=99, description="side of the strain window, displacements, odd"
    )
    reference_frames: Count = Field(
        16, ge=2, le=10_000, description="frames averaged into the reference"
    )
    prefilter: Annotated[Pixels, Field(ge=0, le=5)] | None = Field(
        None,
        description="Gaussian that smooths the gradient of the pattern, px; 0 is none"
        ' ["auto": by its spectrum and the noise]',
    )

    @field_validator("prefilter", mode="before")
    @classmethod
    def _chosen(cls, value: Any) -> Any:
        return None if value == "auto" else value

    @field_validator("subset", "window")
    @classmethod
    def _odd(cls, value: int) -> int:
        return odd(value)

    @property
    def block(self) -> int:
        """Tiles along the side of that window: the odd number that comes nearest to `subset`."""
        return 2 * max(round((self.subset / self.tile - 1) / 2), 0) + 1


class PatternEstimator(Section):
    """Touches from the whole pattern, with the rigid motion of the camera free."""

    kind: Literal["pattern"] = Field(description="what touches are estimated from")
    modes: Count = Field(200, ge=10, le=2000, description="vibration modes that carry the field")
    bench: Literal["exact", "usual"] | None = Field(
        default=None,
        description="plate, edges and camera are just as the scene says, or as they usually are in"
        " a lab: what is not known of them then enters every σ [usual; exact of a twin that is as"
        " the scene says]",
    )
    start: str = Field(
        default="search",
        min_length=1,
        description="where a frame begins that follows no touches: `search` tries a grid of"
        " candidates, `net` asks the touch net of the package, and a path that of a file",
    )


class StrainEstimator(Section):
    """Touches from strain alone."""

    kind: Literal["strain"] = Field(description="what touches are estimated from")
    touches: bool = Field(
        default=True,
        description="estimate touches from it in every frame; else only its map is drawn",
    )


class NetEstimator(Section):
    """Touches from the strain of the gauges by a trained net."""

    kind: Literal["net"] = Field(description="what touches are estimated from")
    family: Literal["dense", "convolutional", "adversarial"] = Field(
        "dense",
        description="full layers; kernels along a ring of gauges before a layer of 32; or 32 and 32"
        " neurons trained against a critic",
    )
    layers: tuple[Annotated[Count, Field(ge=1, le=100_000)], ...] = Field(
        (32, 32), min_length=1, description="widths of the hidden layers"
    )
    activation: Literal["relu", "tanh", "silu"] = Field("relu", description="activation")
    epochs: Count = Field(30000, ge=1, description="passes over the training set")
    learning_rate: Ratio = Field(1e-3, gt=0, description="step size of Adam")
    inputs: Literal["standard", "asinh", "relative"] = Field(
        "standard",
        description="strains standardised, or before that their inverse hyperbolic sine, or each"
        " over the norm of all, for touches of any force",
    )
    outputs: Literal["raw", "scaled"] = Field(
        "raw", description="begin at 0 mm, or at the mean of the places in units of their spread"
    )
    target_encoding: Literal["columns", "rational"] = Field(
        "columns",
        description="touches as columns in sorted order, or without an order as the coefficients"
        " of a rational function with its poles at their places",
    )
    decay: Literal["constant", "cosine"] = Field(
        "constant", description="keep the step size, or let it fall to 0"
    )
    lbfgs_steps: Count = Field(
        0, ge=0, description="largest number of steps of L-BFGS in double precision after Adam"
    )
    batch: Count | None = Field(
        None, ge=1, description="samples that a step learns from [all of them]"
    )
    magnitude_weight: Length = Field(
        1.0, gt=0, description="k of equation 3: a relative error of 1 counts as much as this, mm"
    )
    seed: Count = Field(0, ge=0, description="seed of the first weights")
    start: Literal["glorot", "he"] = Field(
        "glorot", description="rule by which the first weights are drawn"
    )
    model: Annotated[str, Field(min_length=1)] | None = Field(
        None, description="file that `train` writes and `run` reads [results/SCENE/model.h5]"
    )
    solver_steps: Count = Field(0, ge=0, description="steps of the solver after the net, live")
    base_layers: tuple[Annotated[Count, Field(ge=1, le=100_000)], ...] | None = Field(
        None,
        min_length=1,
        description="widths of the layers of a first net, which estimates bend and twist from the"
        " strain before the touch [one net estimates them and the place together]",
    )
    base_weight: Length = Field(
        1.0, gt=0, description="k of equation 4: bend and twist beside the place, mm per mm and deg"
    )
    base_strain: Literal["total", "change", "direction"] = Field(
        "total",
        description="what the net of places sees of a deformable surface: the strain, its change"
        " since before the touch, or that over its norm, which no load alters",
    )


class RegressionEstimator(Section):
    """Touches from the strain of the gauges by a regression on the training touches."""

    kind: Literal["regression"] = Field(description="what touches are estimated from")
    fit: Literal["linear", "quadratic", "ridge", "gaussian-process", "nearest"] = Field(
        "quadratic", description="which regression"
    )
    model: Annotated[str, Field(min_length=1)] | None = Field(
        None, description="file that `train` writes [results/SCENE/model.h5]"
    )


Estimator = Annotated[
    PatternEstimator | StrainEstimator | NetEstimator | RegressionEstimator,
    Field(discriminator="kind"),
]


class BasesSection(Section):
    """The bent and twisted bases that a net of a deformable surface learns from."""

    count: Count = Field(
        72,
        ge=6,
        le=10_000,
        description="bases to learn from; a sixth as many to watch, and to test",
    )
    bend: tuple[Length, Length] = Field(
        (1.0, 4.0), description="smallest and largest distance by which clamps come nearer, mm"
    )
    twist: tuple[Angle, Angle] = Field(
        (-2.0, 2.0), description="from which to which angle the clamps turn, deg"
    )
    touches: Count = Field(200, ge=1, le=10_000, description="touches on each base")
    elements: Count = Field(20, ge=8, le=80, description="of the shell along a side")
    seed: Count = Field(0, ge=0, description="seed of bases and places")

    @model_validator(mode="after")
    def _rising(self) -> BasesSection:
        spans = {"bend": (self.bend, "mm"), "twist": (self.twist, "deg")}
        for name, ((low, high), unit) in spans.items():
            if low > high or (name == "bend" and low < 0):
                raise PydanticCustomError(
                    "scene",
                    "training.bases.{name} runs from {low} to {high} {unit}; write the smaller"
                    " first, and no bend below 0",
                    {"name": name, "low": f"{low:g}", "high": f"{high:g}", "unit": unit},
                )
        return self


class TrainingSection(Section):
    """The simulated touches that train and test a net."""

    spacing: Length = Field(5.0, gt=0, description="distance between training touches, mm")
    margin: Length = Field(10.0, ge=0, description="distance kept from the edges, mm")
    validation_side: Count = Field(
        14, ge=2, le=1000, description="places a side of the validation grid"
    )
    test_samples: Count = Field(3000, ge=1, description="random touches of the test set")
    test_seed: Count = Field(1, ge=0, description="seed of the test set")
    samples: Annotated[Count, Field(ge=1)] | None = Field(
        None, description="random touches to learn from [those of the grid]"
    )
    force: tuple[
        Annotated[Force, Field(gt=0)],
        Annotated[Force, Field(gt=0)],
    ] = Field((1.0, 1.0), description="smallest and largest force of one touch, N")
    noise: Ratio = Field(
        0.0, ge=0, description="noise of gauges on the face over the mean strain of a touch of 1 N"
    )
    averaged_frames: Count = Field(
        1,
        ge=1,
        le=10**6,
        description="frames that one strain is averaged over, where DIC reads the gauges",
    )
    rendered_images: Count = Field(
        0, ge=0, description="rendered images among what is learnt from, correlated at the gauges"
    )
    rendered_fraction: Ratio = Field(
        0.02, gt=0, lt=1, description="fraction of every batch that is of rendered images"
    )
    bases: BasesSection | None = Field(
        None, description="bends and twists of a deformable surface [the plate is flat]"
    )
