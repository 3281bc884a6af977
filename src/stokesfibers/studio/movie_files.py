"""Writing frames into a movie file: mp4 through ffmpeg, gif through Pillow.

The file appears under its name when it is whole; what is left of a failure is removed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from stokesfibers.core.errors import InputError, MissingExtraError, StokesFibersError

_GIF_COLOURS = 128
_QUALITY = "18"  # constant rate factor of x264: no difference is seen


def write_frames(path: Path, frames: Iterable[bytes], size: tuple[int, int], fps: float) -> None:
    """Write frames, each (height, width, 3) bytes, to the file `path`.

    Raises
    ------
    MissingExtraError
        If ffmpeg is needed and not installed.
    StokesFibersError
        If ffmpeg fails.
    OSError
        If the disk does.
    """
    write = writer(path)
    part = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        write(part, iter(frames), size, fps)
        os.replace(part, path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def writer(path: Path) -> Callable[[Path, Iterator[bytes], tuple[int, int], float], None]:
    """Return what writes files of this kind.

    Raises
    ------
    InputError
        If the name does not end in .mp4 or .gif, or the folder does not exist.
    MissingExtraError
        If it is not installed.
    """
    kinds = {".mp4": _mp4, ".gif": _gif}
    kind = path.suffix.lower()
    if kind not in kinds:
        raise InputError("OUT", "a file name ending in .mp4 or .gif", str(path))
    if not path.parent.is_dir():
        hint = f"Make {path.parent} first."
        raise InputError("OUT", "a file in a folder that exists", str(path), hint)
    if kind == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError as error:
            raise MissingExtraError("imageio-ffmpeg", "movie", "An mp4 movie") from error
    return kinds[kind]


def _mp4(path: Path, frames: Iterator[bytes], size: tuple[int, int], fps: float) -> None:
    import imageio_ffmpeg

    sink = imageio_ffmpeg.write_frames(
        str(path),
        size,
        fps=fps,  # pyright: ignore[reportArgumentType]
        codec="libx264",
        quality=None,  # pyright: ignore[reportArgumentType]
        macro_block_size=2,
        output_params=["-crf", _QUALITY, "-preset", "medium", "-movflags", "+faststart"],
    )
    try:
        sink.send(None)
        for frame in frames:
            sink.send(frame)
    except OSError as error:
        raise StokesFibersError(f"ffmpeg could not write {path.name}: {error}") from error
    finally:
        sink.close()


def _gif(path: Path, frames: Iterator[bytes], size: tuple[int, int], fps: float) -> None:
    from PIL import Image

    def pictures() -> Iterator[Image.Image]:
        for frame in frames:
            whole = Image.frombytes("RGB", size, frame)
            yield whole.quantize(_GIF_COLOURS, dither=Image.Dither.NONE)

    every = pictures()
    first = next(every)
    pause = max(20, round(100.0 / fps) * 10)  # in hundredths of a second, as gif has it
    choices = {"save_all": True, "append_images": every, "duration": pause, "loop": 0}
    with path.open("wb") as file:  # Pillow leaves its own open after an error
        first.save(file, format="GIF", optimize=False, **choices)
