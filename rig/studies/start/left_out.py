"""What each scene leaves out, and what it would cost to leave nothing out.

Parts: scenes, costs. Each line is a process of its own; wall times.
"""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import rig
from rig.report.figure import Figure
from rig.scene import shipped
from rig.studies.start import child
from rig.studies.study import line, part, run

FRAMES = 120
EVERYTHING = """
[outputs.tuio]
[outputs.websocket]
port = 0
"""


def scenes() -> Iterator[Figure]:
    """Name the parts of each shipped scene, those left out, and what looking at it loads."""
    for name in shipped():
        seen = child.command("show", name, "--json")
        said = json.loads(seen.said)
        yield from line(
            "Parts of the shipped scenes",
            name,
            holds=", ".join(each["name"] for each in said["parts"]),
            costs="; ".join(each["cost"] for each in said["parts"] if each["cost"]),
            leaves_out=", ".join(each["name"] for each in said["left_out"]),
            start=(seen.seconds, "s"),
        )


def costs() -> Iterator[Figure]:
    """Run the twin with less and with more than it ships with."""
    rate = part(rig.load("twin").camera).rate
    text = (Path(rig.__file__).parent / "scenes" / "twin.toml").read_text(encoding="utf-8")
    without = text.replace('[comparison]\nkind = "strain"\n', "")
    with tempfile.TemporaryDirectory() as folder:
        ways: dict[str, tuple[str, list[str]]] = {
            "touches from the pattern, nothing else": (without, ["--headless"]),
            "as shipped, without page": (text, ["--headless"]),
            "as shipped (default)": (text.replace("port = 8765", "port = 0"), []),
            "and recorded": (text, ["--headless", "--record", f"{folder}/session.h5"]),
            "everything: page, outputs, recorded": (
                text.replace("port = 8765", "port = 0") + EVERYTHING,
                ["--record", f"{folder}/all.h5"],
            ),
        }
        for name, (scene, words) in ways.items():
            path = Path(folder, "scene.toml")
            path.write_text(scene, encoding="utf-8")
            seen = child.command("run", str(path), "--frames", str(FRAMES), *words, "--json")
            said = json.loads(seen.said.splitlines()[-1])
            yield from line(
                f"What parts of the twin cost, {rate:g} frames a second asked",
                name,
                frame=(said["latency_ms"]["median"], "ms"),
                late_frame=(said["latency_ms"]["p95"], "ms, p95"),
                rate=(said["fps"], "frames/s"),
                memory=(seen.memory, "MB"),
                start_to_end=(seen.seconds, "s"),
                heavy_modules=", ".join(seen.modules),
            )


PARTS = {"scenes": scenes, "costs": costs}

if __name__ == "__main__":
    run(PARTS, __doc__)
