"""Grey windows to calibrate with: a navigation set's training part, or a folder of pictures."""
import pathlib

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError

from batches import Samples
from navset import SIDE, NavSet

SUFFIXES = {".png", ".pgm", ".jpg", ".jpeg"}
FEWEST = 24


def window(path):
    """u8[256, 256]: the middle of a picture, its shorter side made 256 px."""
    try:
        with Image.open(path) as picture:
            if picture.mode.startswith(("I", "F")):
                raise ValueError(f"{path}: {picture.mode} pixels of more than 8 bits; convert it to 8-bit grey")
            return np.array(ImageOps.fit(picture.convert("L"), (SIDE, SIDE), Image.Resampling.BOX))
    except (UnidentifiedImageError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(f"{path}: not a picture that can be read ({error}); replace it or take it away") from None


def load(folder, most, seed):
    """(windows u8[n, 256, 256], whether each shows a target or None where nobody says, words about them): at most `most`,
    drawn by seed."""
    folder = pathlib.Path(folder)
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder; give one of pictures, or a navigation set")
    random = np.random.default_rng([seed, 4])
    if (folder / "manifest.json").exists() and (folder / "images.u8").exists():
        navset = NavSet(folder)
        samples = Samples([navset], "train")
        order = random.permutation(len(samples))[:most]
        words = f"{navset.manifest.get('set', folder.name)} seed {navset.manifest.get('seed', '-')}"
        images, present = (samples.images(order) if len(order) else order), samples.present[order] > 0
    else:
        paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
        paths = [paths[i] for i in random.permutation(len(paths))[:most]]
        images, present, words = [window(path) for path in paths], None, f"pictures of {folder.name}"
    if len(images) < FEWEST:
        kinds = ", ".join(sorted(SUFFIXES))
        raise ValueError(f"{folder}: {len(images)} images ({kinds}, or a navigation set's training part); "
                         f"at least {FEWEST} are needed, better some hundreds")
    return np.stack(images), present, f"{len(images)} images, {words}"
