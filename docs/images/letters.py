"""Film a finger that writes on the plate of the paper's bench: docs/images/paper-letters.webp.

Usage: ``python docs/images/letters.py FOLDER``; the net of paper-bench must be trained. Four frames
a second and a slow finger leave the machine time, whatever else it does.
"""

import subprocess
import sys
from pathlib import Path

import cv2
from PIL import Image

HERE = Path(__file__).parent
WIDTH, EVERY, QUALITY = 960, 2, 60
FRAMES, RATE = 190, 4


def main(folder: str) -> None:
    """Run, export, and make the film small enough for a page."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    settings = "source.script=letters", "source.pace=0.08", f"camera.rate={RATE} fps"
    chosen = [word for setting in settings for word in ("--set", setting)]
    session, out = str(place / "letters.h5"), str(place / "film")
    few = f"--frames={FRAMES}", "--headless"
    touchplate("run", "paper-bench", *chosen, *few, "--record", session)
    touchplate("export", session, out, "--to", "film", "--force")
    film, frames = cv2.VideoCapture(str(place / "film" / "film.mp4")), list[Image.Image]()
    while (read := film.read())[0]:
        image = Image.fromarray(cv2.cvtColor(read[1], cv2.COLOR_BGR2RGB))
        frames.append(image.resize((WIDTH, round(WIDTH * image.height / image.width))))
    kept, last = frames[::EVERY], 1000 * EVERY // RATE
    kept[0].save(
        HERE / "paper-letters.webp",
        save_all=True,
        append_images=kept[1:],
        duration=last // 3,  # three times as quick as it was written
        loop=0,
        quality=QUALITY,
    )


def touchplate(*words: str) -> None:
    """Run the command."""
    command = [sys.executable, "-c", "from rig.cli import main; main()", *words]
    subprocess.run(command, check=True)


if __name__ == "__main__":
    main(sys.argv[1])
