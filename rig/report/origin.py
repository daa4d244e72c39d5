"""Where a report comes from: the machine, the versions, the scenes and the code."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from importlib import import_module
from pathlib import Path

from rig.doctor.machine import check_computer, versions
from rig.scene import load, shipped
from rig.system.cache import key

PACKAGES = ("dic", "fe", "synthetic", "models", "rig")


@dataclass(frozen=True)
class Origin:
    """How a report was made.

    Attributes
    ----------
    effort : str
    left_out : tuple of str
        Titles of the studies that were not asked for.
    now : datetime
    """

    effort: str
    left_out: tuple[str, ...]
    now: datetime

    @property
    def built(self) -> str:
        """When, how and on what machine it was built."""
        computer = "; ".join(finding.text for finding in check_computer())
        return (
            f"Built on {self.now:%Y-%m-%d %H:%M} by `touchplate report`, effort {self.effort}, on"
            f" {processor()}; {computer}. Times are of one thread unless stated."
        )

    @property
    def particulars(self) -> str:
        """What is missing, versions and scenes, in paragraphs."""
        missing = f" Left out of it: {'; '.join(self.left_out)}." if self.left_out else ""
        named = ", ".join(f"{name} {version}" for name, version in versions().items() if version)
        scenes = ", ".join(f"{name} `{digest[:12]}`" for name, digest in scene_hashes().items())
        return "\n\n".join(
            [
                "Figures and outcomes of each study stand in `raw/`, a CSV and a JSON file each."
                f" Seeds are fixed in the studies.{missing}",
                f"Versions: Python {platform.python_version()}, {named}.",
                f"Scenes, by the hash of their content: {scenes}.",
            ]
        )


def processor() -> str:
    """Return the name of the processor."""
    known = Path("/proc/cpuinfo")
    lines = known.read_text(encoding="utf-8").splitlines() if known.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def scene_hashes() -> dict[str, str]:
    """Return the hash of the content of each shipped scene, by its name."""
    return {name: key("scene", load(name).model_dump(mode="json")) for name in shipped()}


def code_hash(home: Path) -> str:
    """Return the hash of the code of all five packages, and of the studies in `home`."""
    digest = sha256()
    for folder in (home, *(Path(import_module(name).__path__[0]) for name in PACKAGES)):
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
