"""Writing of frames as a film: MP4 for every browser, or GIF."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.files import check_output, write_whole
from .packages import check_packages

Frames = Iterable[NDArray[np.uint8]]
FILMS = (".mp4", ".gif")
"""Suffixes of files for films."""
QUALITY = "23"
"""Quality of H.264, its usual value; a smaller one gives a better picture and a larger file."""
COLOURS = 64
"""Number of colours of a GIF."""


def write_film(frames: Frames, path: str | Path, rate: float, size: tuple[int, int]) -> None:
    """Write frames, each (height, width, 3), as a film, whole or not at all.

    rate: frames per second. size: width and height (px), even numbers for MP4. Raises InputError for a name
    with another suffix, or where the extra 'render' is missing.
    """
    check_output(path, FILMS)
    write = _write_gif if Path(path).suffix.lower() == ".gif" else _write_mp4
    with write_whole(path) as temporary:
        write(frames, temporary, rate, size)


def _write_mp4(frames: Frames, path: Path, rate: float, size: tuple[int, int]) -> None:
    check_packages("imageio_ffmpeg")
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path),
        size,
        fps=rate,
        codec="libx264",
        macro_block_size=2,
        output_params=["-crf", QUALITY, "-preset", "slow", "-movflags", "+faststart"],
    )
    writer.send(None)
    try:
        for frame in frames:
            writer.send(np.ascontiguousarray(frame))
    finally:
        writer.close()


def _write_gif(frames: Frames, path: Path, rate: float, size: tuple[int, int]) -> None:
    from PIL import Image

    def pictures() -> Iterator[Image.Image]:
        palette = None
        for frame in frames:
            image = Image.fromarray(frame)
            if palette is None:  # the same for all frames: no flicker, and a smaller file
                palette = image.quantize(COLOURS)
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    first, *others = pictures()
    first.save(path, save_all=True, append_images=others, duration=1e3 / rate, loop=0, optimize=True)
