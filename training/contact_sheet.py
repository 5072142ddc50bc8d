#!/usr/bin/env python3
"""Draws images of a navigation set in a grid: a PNG for people. Each is framed by class (light: target, with its box
and d; dark: negative) and captioned with what the label says."""
import argparse

from PIL import Image, ImageDraw

from navset import NavSet

SIDE = 256


def tile(navset, index, caption):
    row = navset.labels[index]
    picture = Image.fromarray(navset.images[index]).convert("RGB")
    draw = ImageDraw.Draw(picture)
    if caption:
        if row["class"] == 1:
            draw.rectangle([row["x0"], row["y0"], row["x1"], row["y1"]], outline=(80, 255, 80))
            radius = row["d_px"] / 2
            draw.ellipse([row["x"] - radius, row["y"] - radius, row["x"] + radius, row["y"] + radius], outline=(255, 200, 0))
            text = f"{row['d_px']:.0f} px {row['range_m']:.1f} m {100 * row['visible']:.0f}% {row['livery']} {row['light']}"
        else:
            text = f"{row['subject']} {row['background']} {row['light']}"
        draw.rectangle([0, SIDE - 11, SIDE, SIDE], fill=(0, 0, 0))
        draw.text((2, SIDE - 11), text, fill=(255, 255, 0) if row["class"] == 1 else (200, 200, 255))
    return picture


def sheet(navset, indices, columns, caption=True):
    rows = (len(indices) + columns - 1) // columns
    picture = Image.new("RGB", (columns * (SIDE + 4), rows * (SIDE + 4)))
    for k, index in enumerate(indices):
        picture.paste(tile(navset, index, caption), ((k % columns) * (SIDE + 4) + 2, (k // columns) * (SIDE + 4) + 2))
    return picture


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", help="folder that berth_navset wrote")
    parser.add_argument("png")
    parser.add_argument("--subject", help="only images of this subject: target, background, clutter, robot, ...")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=48)
    parser.add_argument("--columns", type=int, default=8)
    parser.add_argument("--bare", action="store_true", help="no boxes, no captions")
    arguments = parser.parse_args()
    navset = NavSet(arguments.set)
    indices = [i for i in range(len(navset.images))
               if arguments.subject in (None, navset.labels[i]["subject"])][arguments.first:][:arguments.count]
    sheet(navset, indices, arguments.columns, not arguments.bare).save(arguments.png)


if __name__ == "__main__":
    main()
