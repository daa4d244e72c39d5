"""Draw the image of the tutorial on a plate: the errors that `touchplate design` expects.

python docs/images/plate.py
"""

import subprocess
import sys
import tempfile
from pathlib import Path

IMAGES = Path(__file__).parent
TUTORIAL = IMAGES.parent / "tutorials/plate.md"


def own_scene(folder: str) -> Path:
    """Write the scene that stands in the tutorial into a folder."""
    text = TUTORIAL.read_text(encoding="utf-8")
    path = Path(folder) / "my-plate.toml"
    path.write_text(text.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    return path


def main() -> None:
    """Draw it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [Path(sys.executable).with_name("touchplate"), "design", own_scene(folder)]
        command += ["--plot", IMAGES / "plate-design.png"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
