"""Make the pictures of the site's gallery: run the files of jobs/, keep map and time.

    python scripts/pictures/gallery.py [NAME...] [--most SECONDS]

Each file of jobs/ (or those of the given stems) is run as its command in the gallery
says, on one core; its map becomes .pictures/gallery/NAME.png, its processor time goes
to made.json. A campaign that takes more than SECONDS (default 300) is ended and left
out of the gallery's pictures, with a line that says so.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import JOBS, TOP, parser_of, processor_time, working_folder

PLACE = TOP / ".pictures/gallery"
MADE = PLACE / "made.json"


def made(name: str, folder: Path, most: float) -> dict[str, object] | None:
    """Run a job and keep its map; return its command and time, None if it was ended.

    most : seconds of the clock after which it is ended
    """
    command = ["hpcwhirl", "campaign", f"jobs/{name}.toml"]
    if "refine" not in (JOBS / f"{name}.toml").read_text("utf-8"):
        command += ["--preset", "draft"]
    call = [sys.executable, "-m", *command, "--out", str(folder), "--report", "no"]
    began = processor_time()
    try:
        subprocess.run(call, check=True, capture_output=True, cwd=TOP, timeout=most)
    except subprocess.TimeoutExpired:
        print(f"{name}: ended after {most:g} s")
        return None
    except subprocess.CalledProcessError as failed:
        print(f"{name}: exit {failed.returncode}: {failed.stderr.decode()[-300:]}")
        return None
    PLACE.mkdir(parents=True, exist_ok=True)
    shutil.copy(folder / "map.png", PLACE / f"{name}.png")
    return {"command": " ".join(command), "seconds": processor_time() - began}


def main() -> None:
    """Make the pictures of the jobs that the command line names, all by default."""
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--most", type=float, default=300.0)
    given = parser.parse_args()
    known = json.loads(MADE.read_text("utf-8")) if MADE.is_file() else {}
    names = given.names or sorted(path.stem for path in JOBS.glob("*.toml"))
    for name in names:
        with working_folder(None, "gallery") as folder:
            row = made(name, folder / "out", given.most)
        if row:
            known[name] = row
            MADE.write_text(json.dumps(known, indent=2, sort_keys=True) + "\n", "utf-8")
            print(f"{name}: {row['seconds']:.0f} s")


if __name__ == "__main__":
    main()
