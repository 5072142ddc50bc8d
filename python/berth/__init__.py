"""Docking vision: markers and their poses, with the same bits on every machine."""

from collections.abc import Iterator
from typing import Any, Union

from ._berth import *  # noqa: F403
from ._berth import Detector, FrameResult, Source


def run(source: Union[str, Source], **settings: Any) -> Iterator[FrameResult]:
    """The results of a source's frames, one after the other.

    settings are Detector's. The camera is the source's own unless one is given.
    """
    if isinstance(source, str):
        source = Source(source)
    if settings.get("camera") is None and source.camera is not None and settings.get("marker_size_m"):
        settings["camera"] = source.camera
    detector = None
    for frame in source:
        if detector is None:
            height, width = frame.image.shape
            detector = Detector(width, height, **settings)
        yield detector.detect(frame)
