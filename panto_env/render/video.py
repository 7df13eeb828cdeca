"""Writing of frames as a film: MP4 for every browser, or GIF."""

from __future__ import annotations

import errno
import os
import shutil
import signal
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryFile
from typing import IO, cast

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..base.extras import require
from ..base.files import check_output, write_whole

Frames = Iterable[NDArray[np.uint8]]
FILMS = (".mp4", ".gif")  # suffixes of files for films


def write_film(frames: Frames, path: str | Path, rate: float, size: tuple[int, int]) -> None:
    """Write frames, each (height, width, 3), as a film, whole or not at all.

    rate: frames per second. size: width and height (px), even numbers for MP4. Raises InputError for a name
    with another suffix, where the extra 'render' is missing, or where the encoder fails: then a film that was
    there before stays.
    """
    check_output(path, FILMS)
    write = _write_gif if Path(path).suffix.lower() == ".gif" else _write_mp4
    drawn = iter(frames)
    first = next(drawn, None)
    if first is None:
        raise InputError("A film of no frame cannot be written; show a longer part of the run.")
    with write_whole(path) as temporary:
        write(chain([first], drawn), temporary, rate, size)


def _write_mp4(frames: Frames, path: Path, rate: float, size: tuple[int, int]) -> None:
    """Write through FFmpeg, started here since imageio-ffmpeg's writer does not report how FFmpeg ended.

    Raises OSError, with its number where that is known, unless FFmpeg took all frames and ended well.
    """
    given = f"-y -v error -f rawvideo -pix_fmt rgb24 -s {size[0]}x{size[1]} -r {rate:.6f} -i - -an"
    made = "-vcodec libx264 -pix_fmt yuv420p -crf 23 -preset slow -movflags +faststart"
    command = [_encoder(), *f"{given} {made}".split(), str(path)]
    with TemporaryFile() as remarks:
        # In a session of its own it gets no interrupt from the keyboard: whether it ends is decided here.
        process = Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=remarks, start_new_session=True)
        pipe, whole = cast(IO[bytes], process.stdin), False
        try:
            for frame in frames:
                pipe.write(np.ascontiguousarray(frame).data)
            pipe.close()
            whole = True
        except BrokenPipeError:
            pass  # it has ended, and says why
        except BaseException:
            process.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                pipe.close()
            status = process.wait()
        if status or not whole or not path.stat().st_size:
            remarks.seek(0)
            raise _failure(status, remarks.read().decode(errors="replace"))


def _encoder() -> str:
    require("A film", "render", "imageio_ffmpeg")
    import imageio_ffmpeg

    try:
        found = shutil.which(str(imageio_ffmpeg.get_ffmpeg_exe()))
    except RuntimeError:  # of imageio-ffmpeg, which looks in several places
        found = None
    if found is None:
        raise InputError("Films in MP4 need FFmpeg, and none was found; install it, or write a .gif.")
    return found


def _failure(status: int, remarks: str) -> OSError:
    if status < 0 and -status == getattr(signal, "SIGXFSZ", None):
        return OSError(errno.EFBIG, os.strerror(errno.EFBIG))
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO):
        if os.strerror(number) in remarks:
            return OSError(number, os.strerror(number))
    if status < 0:
        return OSError(f"FFmpeg was killed by {signal.Signals(-status).name}")
    last = remarks.strip().splitlines()[-1:]
    return OSError(": ".join([f"FFmpeg ended too early, with status {status}", *last]))


def _write_gif(frames: Frames, path: Path, rate: float, size: tuple[int, int]) -> None:
    from PIL import Image

    def pictures() -> Iterator[Image.Image]:
        palette = None
        for frame in frames:
            image = Image.fromarray(frame)
            if palette is None:  # the same for all frames: no flicker, and a smaller file
                palette = image.quantize(64)
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    first, *others = pictures()
    first.save(path, save_all=True, append_images=others, duration=1e3 / rate, loop=0, optimize=True)
