"""Whether a result of the reduced plate can be trusted."""

from __future__ import annotations

from enum import Enum


class Trust(Enum):
    """What to think of a result; the value is the sentence shown to the user."""

    TRAINED = "the touches lie within what the reduced plate was made from"
    NEAR_EDGE = (
        "a touch lies nearer to an edge than any that the reduced plate was made from; "
        "check it with the shell"
    )
    BEYOND = (
        "the plate is stretched further than in any state that the reduced plate was made from; "
        "reduce it again for a larger force"
    )
    OVERSTRAINED = (
        "the material is strained beyond its limit: the plate yields or breaks, and these numbers "
        "are those of one that does neither"
    )
    NOT_CONVERGED = "the reduced plate found no balance under these touches; do not use the numbers"
