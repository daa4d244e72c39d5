"""Every figure and table of the paper: its scene, its command, its drawing, and how many seeds."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rig.report.figure import Figure, at_most
from rig.scene import load
from rig.studies.paper.drawn import bent, magnitudes, one, several, size
from rig.studies.paper.drawn.recipe import SEEDS as RECIPE_SEEDS
from rig.studies.paper.study import SPENT
from rig.studies.study import line

TITLE = "Every figure and table of the paper"
SPREAD, LONG = 5, 3
"""Seeds that make a spread, and those where one training takes more than two minutes."""

TAKES_LONG = frozenset({"4A, 8×256", "4C, 8×256", "paper-two-magnitudes-best", "paper-deformable"})
"""Rows and scenes whose training takes more than two minutes of one core; of the nets of 8×256 that
is a part of the paper's steps."""


class Row(NamedTuple):
    """One figure or table of the paper.

    Attributes
    ----------
    name, what
        As the paper numbers it, and what it shows.
    scene
        That it comes from.
    settings
        What the command changes of the scene.
    drawing
        PNG in the folder of plots.
    seeds
        Trainings that its rows are the median of; 0 where nothing is drawn by chance.
    """

    name: str
    what: str
    scene: str
    settings: str
    drawing: str
    seeds: int

    @property
    def command(self) -> str:
        """What trains it, or shows it."""
        verb = "train" if self.seeds else "show"
        return f"touchplate {verb} {self.scene} {self.settings}".strip()

    @property
    def asked(self) -> int:
        """How many seeds make its spread; 0 where nothing is drawn by chance."""
        if not self.seeds:
            return 0
        return LONG if TAKES_LONG & {self.name, self.scene} else SPREAD


_ONE, _SIZE, _SEVERAL, _WIDE = one.SEEDS, size.SEEDS, several.SEEDS, several.WIDE_SEEDS
_BENT = {scene: seeds for scene, seeds, _, _ in bent.SYSTEMS.values()}
_ONE_STEP, _STEPS, _DIRECTION = _BENT
_BENCH = SPENT["bench"].seeds
_PAIRS = magnitudes.LONG_SEEDS
_LAYERS, _DOUBLED = "--set estimator.layers=[32,32]", "--set dataset.order=doubled"

ROWS = (
    Row("1, 2A, 2B", "plate, gauges, touches", "paper-one", "", "paper-2a.png", 0),
    Row("2C, 2D", "losses, local losses", "paper-one", "", "paper-2d.png", _ONE),
    Row("3A", "100 random touches", "paper-one", "", "paper-3ab.png", _ONE),
    Row("3B", "histogram of 3000", "paper-one", "", "paper-3ab.png", _ONE),
    Row("3C, S3", "validation on the plate", "paper-bench", "", "paper-letters.png", _BENCH),
    Row("3D", "spacing", "paper-one", "--set gauges.spacing=2", "paper-3d.png", _SIZE),
    Row("3D, 1/1", "spacing 1/1, best recipe", "paper-one-finest", "", "paper-3d.png", _SIZE),
    Row("4A", "three touches, 2×32 and 4×64", "paper-three", _LAYERS, "paper-4a.png", _SEVERAL),
    Row("4A, 8×256", "three touches, 8×256", "paper-three", "", "paper-4a.png", _WIDE),
    Row("4A, best", "three touches, best recipe", "paper-three-best", "", "paper-4a.png", _SEVERAL),
    Row("4B", "100 samples of three touches", "paper-three-best", "", "paper-4b.png", _SEVERAL),
    Row(
        *("4C", "magnitudes by k", "paper-two-magnitudes"),
        *("--set estimator.magnitude_weight=10", "paper-4c.png", magnitudes.SEEDS),
    ),
    Row("4C, 8×256", "magnitudes at k 1", "paper-two-magnitudes", "", "paper-4c.png", _PAIRS),
    Row("4D", "six samples", "paper-two-magnitudes-best", "", "paper-4d.png", _PAIRS),
    Row("5A, 5B", "bend and twist", "paper-deformable", "", "paper-5a.png", 0),
    Row("5C, 5D", "1 step", _ONE_STEP, "", "paper-5cd.png", _BENT[_ONE_STEP]),
    Row("5C, 5D", "2 steps", _STEPS, "", "paper-5cd.png", _BENT[_STEPS]),
    Row("5D, best", "2 steps, direction", _DIRECTION, "", "paper-5cd.png", _BENT[_DIRECTION]),
    Row("Table S1, S1", "search for a net", "paper-one", "", "paper-s1.png", size.TRIALS),
    Row("S2", "regressions", "paper-regression", "", "paper-s2.png", 0),
    Row("2.1", "convolutional net", "paper-cnn", "", "paper-nets.png", _ONE),
    Row("2.1", "adversarial net", "paper-gan", "", "paper-nets.png", _ONE),
    Row("S4", "measurement error", "paper-one", "", "paper-s4.png", _ONE),
    Row("S5", "two touches, 2×32 and 4×64", "paper-two", _LAYERS, "paper-s5.png", _SEVERAL),
    Row("S5, best", "two touches, best recipe", "paper-two-best", "", "paper-s5.png", _SEVERAL),
    Row("S6", "doubled samples", "paper-two", _DOUBLED, "paper-s6.png", _SEVERAL),
    Row("S7", "histograms of each touch", "paper-two-best", "", "paper-s7.png", _SEVERAL),
    Row("recipe", "what the recipe leaves open", "paper-one", "", "paper-recipe.png", RECIPE_SEEDS),
)


def lacking(row: Row, folder: Path) -> list[str]:
    """Return what a row does not have: a scene that loads, a drawing, a spread."""
    found: list[str] = []
    try:
        load(row.scene)
    except ValueError:
        found.append("command")
    if not (folder / row.drawing).is_file():
        found.append("figure")
    if row.seeds < row.asked:
        found.append("spread")
    return found


def contents(folder: Path) -> Iterator[Figure]:
    """List every figure of the paper, and count those that lack something."""
    without = {row: lacking(row, folder) for row in ROWS}
    for row, missing in without.items():
        yield from line(
            TITLE,
            f"{row.name}: {row.what}",
            scene=row.scene,
            drawing_file=row.drawing,
            seeds=f"{row.seeds} of {row.asked}" if row.seeds else "–",
            lacks=", ".join(missing) or "–",
        )
    count = sum(bool(missing) for missing in without.values())
    said = "rows of the paper without command, figure or spread"
    yield from line(TITLE, said, rows=(count, "", at_most(0), len(ROWS)))
