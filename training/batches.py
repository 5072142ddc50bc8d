"""From a set's bytes to a network's input: batches by number, contrast normalisation, augmentation.

Everything random is drawn from (seed, iteration), never from a running state: a run resumed at any iteration sees what
the uninterrupted run would have seen."""
import math

import numpy as np

BATCH = 50
SIDE = 256
SPREAD = 48  # grey levels: the standard deviation that contrast normalisation aims at


def normalised(images):
    """s8[n, 256, 256] from u8: mean taken off, contrast stretched or squeezed to SPREAD.

    Integers throughout, so that a device can do the same: m = (sum + 2^15) >> 16, v = max(0, (sum of squares >> 16)
    - m^2), s = max(1, isqrt(v)), gain = clamp((256 * SPREAD + (s >> 1)) / s, 128, 2048) rounded down, in 1/256;
    out = clamp(((x - m) * gain + 128) >> 8, -128, 127)."""
    grey = np.arange(256)
    out = np.empty(images.shape, np.int8)
    for image, result in zip(images, out):
        counts = np.bincount(image.ravel(), minlength=256)
        mean = (int(counts @ grey) + (1 << 15)) >> 16
        spread = max(1, math.isqrt(max(0, (int(counts @ (grey * grey)) >> 16) - mean * mean)))
        gain = min(2048, max(128, (256 * SPREAD + (spread >> 1)) // spread))
        np.take(np.clip(((grey - mean) * gain + 128) >> 8, -128, 127).astype(np.int8), image, out=result)
    return out


def training_batch(seed, iteration, count, size=BATCH):
    """Indices (of `count`) of batch `iteration`: each epoch a permutation, its last batch filled from its start."""
    per_epoch = (count + size - 1) // size
    epoch, k = divmod(iteration, per_epoch)
    order = np.random.default_rng([seed, 1, epoch]).permutation(count)
    return order[np.arange(k * size, (k + 1) * size) % count]


def balanced_batch(seed, iteration, present):
    """As training_batch, half of it targets: they are fewer, and more is to be learnt from them."""
    halves = [np.flatnonzero(present == kind) for kind in (0, 1)]
    return np.concatenate([half[training_batch([seed, k], iteration, len(half), BATCH // 2)]
                           for k, half in enumerate(halves)])


def shifted(image, dx, dy):
    """Moved right and down; what is uncovered repeats the rim."""
    rows = np.clip(np.arange(SIDE) - dy, 0, SIDE - 1)
    columns = np.clip(np.arange(SIDE) - dx, 0, SIDE - 1)
    return image[rows[:, None], columns[None, :]]


def augmented(seed, iteration, images, x, y, d):
    """Quarter turns, mirror images, shifts, gain and offset. Returns u8 images, and centres (px) moved along."""
    random = np.random.default_rng([seed, 2, iteration])
    images, x, y = images.copy(), x.copy(), y.copy()
    last = SIDE - 1
    for i, image in enumerate(images):
        turns, mirror = random.integers(4), random.integers(2)
        dx, dy = random.integers(-8, 9, 2)
        gain, offset = np.exp(random.uniform(-0.3, 0.3)), random.uniform(-10, 10)
        for _ in range(turns):  # counter-clockwise: the right rim becomes the upper one
            image = np.rot90(image)
            x[i], y[i] = y[i], last - x[i]
        if mirror:
            image = image[:, ::-1]
            x[i] = last - x[i]
        image = shifted(image, dx, dy)
        x[i] += dx
        y[i] += dy
        images[i] = np.clip(image * np.float32(gain) + np.float32(offset), 0, 255).astype(np.uint8)
    return images, x, y, d


class Samples:
    """The `part` of one or several sets, as one."""

    def __init__(self, navsets, part, limit=None):
        self.navsets = navsets
        self.place = [(k, i) for k, navset in enumerate(navsets) for i in navset.part(part)][:limit]

        def column(name):
            return np.array([navsets[k].labels[i][name] for k, i in self.place], dtype=np.float32)

        self.present, self.x, self.y, self.d = column("class"), column("x"), column("y"), column("d_px")
        self.visible = column("visible")

    def __len__(self):
        return len(self.place)

    def images(self, indices):
        """u8[n, 256, 256]"""
        return np.stack([self.navsets[k].images[i] for k, i in (self.place[j] for j in indices)])

    def mean(self):
        """Training mean, grey levels, from every 16th image."""
        return float(np.mean([self.navsets[k].images[i].mean() for k, i in self.place[::16]]))
