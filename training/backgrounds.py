#!/usr/bin/env python3
"""Cuts grey 1024 px squares from the pictures of installed (or unpacked) packages, for berth_navset --photos.

Installs nothing. `--list` names the packages, their licences and how to get them; every package that is not there is
left out and said so. The crops depend on the pictures and on the JPEG decoder alone: scaling is done in integers."""
import argparse
import pathlib
import re
import sys

import numpy as np
from PIL import Image

SIDE = 1024
LEAST = 400  # px: smaller pictures would only be blown up

# name, where its pictures are (below the root, or in site-packages), crops of each (a fraction: of every so many
# pictures one), licence
DEBIAN = [
    ("plasma-workspace-wallpapers", "usr/share/wallpapers/*/contents/images*/*", 3, "CC-BY-SA-4.0, LGPL-3"),
    ("mate-backgrounds", "usr/share/backgrounds/mate/*/*", 3, "GPL-2+, CC-BY-SA-4.0"),
    ("gnome-backgrounds", "usr/share/backgrounds/gnome/*", 3, "CC-BY-SA-3.0"),
    ("lomiri-wallpapers", "usr/share/backgrounds/*", 3, "CC-BY-SA-3.0+"),
    ("xplanet-images", "usr/share/xplanet/images/*", 3, "GPL-2+, public domain (NASA)"),
    ("stellarium-data", "usr/share/stellarium/landscapes/*/*", 3, "GPL-2+ and free licences of the panoramas"),
    ("stellarium-data", "usr/share/stellarium/nebulae/default/*", 1 / 5, "GPL-2+, public domain (NASA, ESA), CC-BY"),
    ("stellarium-data", "usr/share/stellarium/textures/*", 1, "GPL-2+, public domain (NASA)"),
]
PYPI = [
    ("scikit-image", "skimage/data/*", 2, "BSD-3-Clause, CC0, public domain"),
    ("scikit-learn", "sklearn/datasets/images/*", 2, "BSD-3-Clause, CC-BY"),
]
SUFFIXES = {".jpg", ".jpeg", ".png", ".webp"}
# Diagrams, sky maps' text and interface graphics are no backgrounds.
UNWANTED = re.compile(r"(_screenshot|/bt|/btn|icon|logo|glyph|cursor|compass|pointer|coin|text|horse|binary|cell\.|"
                      r"phantom|clock|checker|chessboard|microaneurysms|no_time|blank)", re.IGNORECASE)


def packages():
    lines = ["Debian: apt-get install NAME, or apt-get download NAME and dpkg -x NAME*.deb ROOT"]
    lines += [f"  {name:30} {licence}" for name, _, _, licence in DEBIAN]
    lines += ["PyPI: pip install NAME"]
    lines += [f"  {name:30} {licence}" for name, _, _, licence in PYPI]
    return "\n".join(lines)


def grey(path):
    """u8[height, width], transparent parts dark."""
    with Image.open(path) as picture:
        if picture.mode in ("RGBA", "LA", "P"):
            picture = picture.convert("RGBA")
            ground = Image.new("RGBA", picture.size, (20, 20, 20, 255))
            ground.alpha_composite(picture)
            picture = ground
        return np.asarray(picture.convert("L"))


def resized(image, width, height):
    """Area means on the way down, the nearest pixel on the way up, in integers."""
    for axis, size in ((0, height), (1, width)):
        old = image.shape[axis]
        if size >= old:
            image = np.take(image, np.arange(size) * old // size, axis=axis)
            continue
        edges = np.arange(size + 1) * old // size
        sums = np.concatenate([np.zeros_like(np.take(image, [0], axis=axis), dtype=np.int64),
                               np.cumsum(image, axis=axis, dtype=np.int64)], axis=axis)
        count = np.diff(edges).reshape((-1, 1) if axis == 0 else (1, -1))
        image = ((np.take(sums, edges[1:], axis=axis) - np.take(sums, edges[:-1], axis=axis)) // count).astype(np.uint8)
    return image


def crops(image, count):
    """Up to `count` squares of SIDE along the picture's longer side, none of them flat or black."""
    height, width = image.shape
    if min(height, width) < LEAST:
        return
    short = min(height, width)
    image = resized(image, max(SIDE, width * SIDE // short), max(SIDE, height * SIDE // short))
    height, width = image.shape
    slack = max(height, width) - SIDE
    # Neighbouring squares overlap by half at most.
    count = max(1, min(count, 1 + 2 * slack // SIDE))
    for k in range(count):
        offset = slack * k // (count - 1) if count > 1 else slack // 2
        crop = image[:SIDE, offset:offset + SIDE] if width > height else image[offset:offset + SIDE, :SIDE]
        if crop.std() >= 6 and np.percentile(crop, 99) >= 30:
            yield crop


def pictures(folder, pattern):
    best = {}
    for path in sorted(folder.glob(pattern)):
        if path.suffix.lower() not in SUFFIXES or not path.is_file() or UNWANTED.search(str(path)):
            continue
        # A wallpaper comes in many sizes: the largest file of a folder "contents/images" stands for all.
        key = path.parent if path.parent.name.startswith("images") and path.parent.parent.name == "contents" else path
        if key not in best or path.stat().st_size > best[key].stat().st_size:
            best[key] = path
    return sorted(best.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", help="where to write the crops and index.txt")
    parser.add_argument("--root", default="/", help="where Debian packages are installed or unpacked")
    parser.add_argument("--site", help="where Python packages are installed or unpacked")
    parser.add_argument("--pictures", action="append", default=[], help="a folder of further pictures (one crop each)")
    parser.add_argument("--list", action="store_true", help="name the packages and their licences")
    arguments = parser.parse_args()
    if arguments.list or not arguments.folder:
        print(packages())
        return
    sources = [(name, pathlib.Path(arguments.root), pattern, count) for name, pattern, count, _ in DEBIAN]
    site = arguments.site or next((p for p in sys.path if p.endswith("site-packages")), None)
    if site:
        site = pathlib.Path(site)
        sources += [(name, site, pattern, count) for name, pattern, count, _ in PYPI]
    sources += [(pathlib.Path(p).name, pathlib.Path(p), "*", 1) for p in arguments.pictures]

    out = pathlib.Path(arguments.folder)
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*.pgm"):
        old.unlink()
    written = 0
    with open(out / "index.txt", "w") as index:
        for name, folder, pattern, count in sources:
            before = written
            found = pictures(folder, pattern)
            if count < 1:
                found, count = found[::round(1 / count)], 1
            for path in found:
                try:
                    image = grey(path)
                except (OSError, ValueError, Image.DecompressionBombError) as error:
                    print(f"{path}: {error}", file=sys.stderr)
                    continue
                source = re.sub(r"[^A-Za-z0-9_.-]", "_", f"{name}:{path.relative_to(folder)}")
                for crop in crops(image, count):
                    file = f"photo-{written:04d}.pgm"
                    (out / file).write_bytes(b"P5\n%d %d\n255\n" % (SIDE, SIDE) + np.ascontiguousarray(crop).tobytes())
                    index.write(f"{file} {source}\n")
                    written += 1
            print(f"{name}: {len(found)} pictures, {written - before} crops" if found else f"{name}: not there")
    print(f"{written} crops in {out}")


if __name__ == "__main__":
    main()
