#!/usr/bin/env python3
"""Draws a run's log.csv as the paper's Figure 5: loss (left axis) and accuracy (right) over iterations, as SVG."""
import argparse
import csv
import pathlib

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 860, 480, 64, 64, 40, 52


def points(rows, name):
    return [(int(row["iteration"]), float(row[name])) for row in rows if row[name]]


def smoothed(values, window):
    """Means over `window` neighbours, the same number of points."""
    out = []
    for i, (x, _) in enumerate(values):
        near = values[max(0, i - window // 2):i + window // 2 + 1]
        out.append((x, sum(y for _, y in near) / len(near)))
    return out


def round_up(value):
    """The next of 1, 2, 5 times a power of ten."""
    step = 1e-6
    while True:
        for factor in (1, 2, 5):
            if step * factor >= value:
                return step * factor
        step *= 10


def curve(values, x_of, y_of, colour, dots=False):
    path = " ".join(f"{x_of(x):.1f},{y_of(y):.1f}" for x, y in values)
    parts = [f'<polyline fill="none" stroke="{colour}" stroke-width="1.6" points="{path}"/>']
    if dots:
        parts += [f'<circle cx="{x_of(x):.1f}" cy="{y_of(y):.1f}" r="3" fill="{colour}"/>' for x, y in values]
    return parts


def svg(rows, title):
    last = max(int(row["iteration"]) for row in rows)
    window = max(1, len(rows) // 60)
    train_loss, test_loss = smoothed(points(rows, "train_loss"), window), points(rows, "test_loss")
    train_accuracy, test_accuracy = smoothed(points(rows, "train_accuracy"), window), points(rows, "test_accuracy")
    loss_top = round_up(max(y for _, y in train_loss + test_loss))
    accuracy_low = min(0.9, int(min(y for _, y in train_accuracy + test_accuracy) * 10) / 10)

    def x_of(x):
        return LEFT + (WIDTH - LEFT - RIGHT) * x / last

    def loss_y(y):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y / loss_top

    def accuracy_y(y):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (y - accuracy_low) / (1 - accuracy_low)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
           f'font-size="13" fill="#222"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{WIDTH / 2}" y="22" text-anchor="middle" font-size="15">{title}</text>']
    for k in range(6):
        y = HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * k / 5
        out += [f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>',
                f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{loss_top * k / 5:.3g}</text>',
                f'<text x="{WIDTH - RIGHT + 8}" y="{y + 4:.1f}">{100 * (accuracy_low + (1 - accuracy_low) * k / 5):.1f}%</text>']
        x = LEFT + (WIDTH - LEFT - RIGHT) * k / 5
        out.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 20}" text-anchor="middle">{last * k // 5}</text>')
    out += [f'<text x="{WIDTH / 2}" y="{HEIGHT - 10}" text-anchor="middle">iteration</text>',
            f'<text x="16" y="{HEIGHT / 2}" transform="rotate(-90 16 {HEIGHT / 2})" text-anchor="middle">loss</text>',
            f'<text x="{WIDTH - 10}" y="{HEIGHT / 2}" transform="rotate(90 {WIDTH - 10} {HEIGHT / 2})" '
            f'text-anchor="middle">accuracy</text>']
    shown = [(train_loss, loss_y, "#e8a33d", "training loss", False), (test_loss, loss_y, "#c0392b", "test loss", True),
             (train_accuracy, accuracy_y, "#7fb3d5", "training accuracy", False),
             (test_accuracy, accuracy_y, "#1f618d", "test accuracy", True)]
    for k, (values, y_of, colour, name, dots) in enumerate(shown):
        out += curve(values, x_of, y_of, colour, dots)
        y = HEIGHT / 2 - 30 + 20 * k
        out += [f'<line x1="{WIDTH - 250}" x2="{WIDTH - 225}" y1="{y - 4}" y2="{y - 4}" stroke="{colour}" stroke-width="3"/>',
                f'<text x="{WIDTH - 218}" y="{y}">{name}</text>']
    return "\n".join([*out, "</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", help="a run's folder")
    parser.add_argument("svg")
    parser.add_argument("--title")
    arguments = parser.parse_args()
    with open(pathlib.Path(arguments.run) / "log.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        parser.error(f"{arguments.run}/log.csv has no rows yet")
    title = arguments.title or f"{pathlib.Path(arguments.run).name}: loss and accuracy during training"
    pathlib.Path(arguments.svg).write_text(svg(rows, title))


if __name__ == "__main__":
    main()
