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
from rig.studies.study import line, run

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
            holds=", ".join(part["name"] for part in said["parts"]),
            costs="; ".join(part["cost"] for part in said["parts"] if part["cost"]),
            leaves_out=", ".join(part["name"] for part in said["left_out"]),
            start=(f"{seen.seconds:.2f}", "s"),
        )


def costs() -> Iterator[Figure]:
    """Run the twin with less and with more than it ships with."""
    shipped_scene = rig.scene.load("twin")
    text = (Path(rig.__file__).parent / "scenes" / "twin.toml").read_text(encoding="utf-8")
    without = text.replace('[comparison]\nkind = "strain"\n', "")
    with tempfile.TemporaryDirectory() as folder:
        ways = {
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
                f"What parts of the twin cost, {shipped_scene.camera.rate:g} frames a second asked",
                name,
                frame=(f"{said['latency_ms']['median']:.1f}", "ms"),
                late_frame=(f"{said['latency_ms']['p95']:.1f}", "ms, p95"),
                rate=(f"{said['fps']:.1f}", "frames/s"),
                memory=(f"{seen.memory:.0f}", "MB"),
                start_to_end=(f"{seen.seconds:.0f}", "s"),
                heavy_modules=", ".join(seen.modules),
            )


PARTS = {"scenes": scenes, "costs": costs}

if __name__ == "__main__":
    run(PARTS, __doc__)
