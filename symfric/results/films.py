"""Films with one short palette for all pictures, as GIF or as an HTML page with a slider."""

from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from symfric.foundation.files import write_text, written
from symfric.foundation.shown import png_uri

DPI = 72
"""Resolution of a film [dots per inch]; with it, films of all scenes have at most 500 kB."""
SHADES = 16
"""Number of colours of a film; the last one is transparent in HTML."""
SAMPLES = 8
"""Number of pictures from which the palette is chosen."""
SEEN = 32
"""Largest number of pictures from which their common part is taken."""


def pictures(figure: Figure, pose: Callable[[int], None], count: int) -> Iterator[Image.Image]:
    """Yield the pictures of a film, which have a common palette.

    Args:
        figure: figure of the film, whose resolution becomes that of the film.
        pose: function of k that changes the figure to picture k.
        count: number of pictures.
    """
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)

    def drawn(k: int) -> Image.Image:
        pose(k)
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    chosen = np.unique(np.linspace(0, count - 1, SAMPLES).round().astype(int))
    seen = np.concatenate([np.asarray(drawn(int(k))) for k in chosen])
    palette = Image.fromarray(seen).quantize(SHADES - 1, method=Image.Quantize.MAXCOVERAGE)
    for k in range(count):
        yield drawn(k).quantize(palette=palette, dither=Image.Dither.NONE)


def write_gif(path: str | Path, film: Sequence[Image.Image], fps: float) -> None:
    """Write a film as GIF, in which each picture has only what differs from the one before it."""
    with written(path) as temporary:
        film[0].save(temporary, "GIF", save_all=True, append_images=film[1:],
                     duration=round(1000 / fps), loop=0)  # fmt: skip


def write_page(path: str | Path, film: Sequence[Image.Image], fps: float) -> None:
    """Write a film as an HTML page, in which each picture lies over what most have in common."""
    common = np.median([np.asarray(picture) for picture in film[:: 1 + len(film) // SEEN]], axis=0)
    common = common.astype(np.uint8)
    shades = (np.asarray(picture) for picture in film)
    layers = [common, *(np.where(own == common, np.uint8(SHADES - 1), own) for own in shades)]
    sources = ",\n".join(f'"{_uri(layer, film[0].getpalette())}"' for layer in layers)
    player = Template(Path(__file__).with_name("player.html").read_text("utf-8"))
    settings = {"pictures": sources, "last": len(film) - 1, "wait": round(1000 / fps)}
    write_text(path, player.substitute(settings))


def _uri(shades: Any, palette: Any) -> str:
    """Return a picture with few colours, the last of which is transparent, as a data URI."""
    picture, buffer = Image.fromarray(shades), BytesIO()
    picture.putpalette([*palette, 255, 255, 255])
    picture.save(buffer, "PNG", bits=4, optimize=True, transparency=SHADES - 1)
    return png_uri(buffer.getvalue())
