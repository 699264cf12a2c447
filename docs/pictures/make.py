"""Draws the pictures of the book with `ptm` (on the path) and makes them small: `just book-pictures`.

Needs Pillow. Sweeps go to target/gallery and are continued there. The pictures of recordings (mrclam-*, woods-*) and
diagnosis.png need data that are not shipped; they are made smaller only.
"""

import subprocess
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
WORK = ROOT / "target" / "gallery"
WIDTH, COLOURS = 1100, 64

TUTORIAL_SWEEP = """\
title = "Which radius and height suit my detections?"

[run]
samples = 5000

[design]
kind = "grid"

[design.factors]
penalty_radius = [3, 10, 30]
penalty_height = [10, 50, 250]
sigma_o = [0.3, 1, 3]
"""

# Name in docs/pictures, and the figure that it is made of, in target/gallery.
PICTURES = {
    "tutorial-world": "ring.png",
    "tutorial-sample": "ring-sample.png",
    "tutorial-map": "ring-map/map.png",
    "tutorial-effects": "mine/figures/effects.png",
    "nested-loop": "mine/figures/nested-loop.png",
    "effects": "noisy/figures/effects.png",
    "recovery": "noisy/figures/recovery.png",
    "run-status": "noisy/figures/run-status.png",
    "faults": "noisy/figures/faults.png",
    "recovery-pair": "noisy/figures/recovery-pair.png",
    "recovery-multiples": "noisy/figures/recovery-multiples.png",
    "traces-by-init": "noisy/figures/traces-by-init.png",
    "timing-ess": "noisy/figures/timing-ess.png",
    "response": "sensitivity/figures/response-recovery.png",
    "screening": "screening/figures/screening.png",
    "indices": "indices/figures/indices.png",
    "figure-7": "figure-7/figures/side-by-side.png",
    "crossing": "crossing/figures/world-1.png",
    "chains": "crossing/figures/cells/c001-chains.png",
}


def ptm(*arguments: str) -> None:
    subprocess.run(["ptm", "-q", *arguments], cwd=WORK, check=True)


def shrink(source: Path, target: Path, width: int) -> None:
    image = Image.open(source).convert("RGBA")
    page = Image.new("RGBA", image.size, "white")
    page.alpha_composite(image)
    page = page.convert("RGB")
    if page.width > width:
        page = page.resize((width, round(page.height * width / page.width)), Image.Resampling.LANCZOS)
    page = page.quantize(COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    page.save(target, optimize=True)


def main() -> None:
    WORK.mkdir(parents=True, exist_ok=True)
    ptm("simulate", "--world", "square-ring", "--noise", "1", "--seed", "4", "--out", "ring.csv")
    settings = "--sigma-o 0.32 --sigma-t 0.64 --penalty-radius 9.2 --penalty-height 372"
    ptm("sample", "ring.csv", *settings.split(), "--map", "ring-map")
    (WORK / "mine.toml").write_text(TUTORIAL_SWEEP)
    ptm("sweep", "mine.toml", "--data", "ring.csv", "--out", "mine")
    for name in ["crossing", "figure-7", "indices", "noisy", "screening", "sensitivity"]:
        ptm("sweep", str(ROOT / "sweeps" / f"{name}.toml"), "--out", name)
    for name, figure in PICTURES.items():
        shrink(WORK / figure, HERE / f"{name}.png", 2400 if name == "figure-7" else WIDTH)
    shrink(WORK / "noisy/figures/effects.png", ROOT / "reports/gallery/noisy-effects.png", 2000)
    total = sum(path.stat().st_size for path in HERE.glob("*.png"))
    print(f"docs/pictures has {total / 1e6:.2f} MB in PNGs")


if __name__ == "__main__":
    main()
