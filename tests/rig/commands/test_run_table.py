"""The table that ends a run in the terminal."""

import pytest

from rig.commands.run import _table
from rig.live.learned import Learned

SUMMARY = {
    "frames": 9, "fps": 30.0, "dropped": 0, "latency_ms": {"median": 8.0, "p95": 9.0},
    "recorded": None, "diagnosis": "", "pattern": None, "strain": None, "net": None,
}  # fmt: skip


def rows(learned):
    table = _table(SUMMARY | {"learned": learned})
    figure, value = (list(column.cells) for column in table.columns)
    return dict(zip(figure, value, strict=True))


@pytest.mark.parametrize(
    ("learned", "says"),
    [
        (Learned(), "learned from 0 touches"),
        (Learned(1, force_sigma=0.0123), "learned from 1 touch, forces known to 1.2 %"),
        (
            Learned(24, 3, 2, 1, 0.2),
            "learned from 24 touches, 3 more gathered, 1 of known weight, 2 strange, left aside,"
            " forces known to 20.0 %",
        ),
    ],
)
def test_the_table_says_how_far_the_learning_of_the_bench_has_come(learned, says):
    assert rows(learned.summary)["bench"] == says


def test_nothing_is_said_of_a_bench_that_is_exact():
    assert "bench" not in rows(None)
