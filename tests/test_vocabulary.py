"""One vocabulary: words that gave way to the field's own stand in no code, test or page."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("dic", "fe", "models", "synthetic", "rig", "benchmarks", "examples", "tests", "docs")
SUFFIXES = {".py", ".pyi", ".toml", ".md", ".yml", ".csv", ".js", ".html", ".css"}
HISTORY = (
    "CHANGELOG.md",
    "docs/decisions",
    "rig/scene/renamed.py",  # keys of older releases
    "tests/rig/scene/test_renamed_keys.py",
    "tests/test_vocabulary.py",
)

RETIRED = {
    r"(?<!/)pictures?": "image (raw), frame (live) or plot (drawn)",
    r"(?:un)?told": "reported, estimated",
    r"mend(?:s|ed|ing)?": "correct",
    r"tall(?:y|ies)": "score",
    r"lessons?|taught": "training plan, trained",
    r"sights?": "visibility, in view",
    r"(?<!\.)eyes?": "camera, view",
    r"unlit": "without gain and offset",
    r"knowledge": "prior, information",
    r"doubts?": "model error, sigma of a prior, uncertainty",
    r"chance(?=[\w(:=,)])|(?<=[._])chance": "p_value",
    r"(?<!at_)(?:most|least)(?:_(?!common|energy|squares)\w+|(?= = |: int|: float))": "max, min",
    r"(?<=\w\.)(?:most|least)(?!\w)": "max, min",
    r"shares?(?= of\b|_| = |: float)|(?<=[._])share|(?<=\ba )share|(?<=\bthe )share": "fraction",
    r"(?<!\.)(?<!def )tell(?=\(| ?: \w|: [A-Z])": "progress, report",
    r"held\s+against": "compared with",
    r"over\s+the\s+bound": "÷ CRB",
    r"what\s+came\s+of": "outcome",
    r"see_(?:gauges|motions|pattern|strain)": "prepare_…",
    r"right_sides?": "gradient",
    r"restless": "moved during the reference",
    r"dic\.(?:advice|choose|compose|follow)\b": "recommend_settings, correlate_sequence, …",
    r"fe\.(?:reduce|regime|view)\b": "reduced_plate, linear_range, ReducedReadings",
    r"models\.gauges(?=\()": "gauge_forward",
    r"synthetic\.(?:looking|motion|rigid|seen|turned)\b": "look_at, image_motion, rotated, …",
}
"""Pattern of a word, in names and in prose -> what to say instead."""

PACKAGES = ("dic", "fe", "models", "synthetic")
COMPUTING = (*PACKAGES, *(f"tests/{name}" for name in PACKAGES), "examples")
RETIRED_WHERE_NOTHING_IS_SERVED = {r"answer(?:s|ed)?": "result, solution, estimate, response"}


def lies_in(path, folders):
    name = path.relative_to(ROOT).as_posix()
    return any(name == folder or name.startswith(f"{folder}/") for folder in folders)


def written():
    """Every text of the tree that people write."""
    inside = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))
    texts = (path for path in (*ROOT.glob("*"), *inside) if path.suffix in SUFFIXES)
    for path in sorted(path for path in texts if not lies_in(path, HISTORY)):
        yield pytest.param(path, id=str(path.relative_to(ROOT)))


@pytest.mark.parametrize("path", list(written()))
def test_retired_words_are_gone(path):
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", path.read_text(encoding="utf-8"))
    words = RETIRED | (RETIRED_WHERE_NOTHING_IS_SERVED if lies_in(path, COMPUTING) else {})
    found = [
        f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}: "
        f"{match.group()!r} is retired; say {instead}"
        for word, instead in words.items()
        for match in re.finditer(rf"(?<![a-z])(?:{word})(?![a-z])", text, re.IGNORECASE)
    ]
    assert not found, "\n".join(found)
