# SPDX-License-Identifier: Apache-2.0
"""Fields as notebooks show them, by nothing but NumPy: a curve as SVG, a map as PNG with a diverging colour scale."""
import base64
import html
import struct
import zlib

import numpy as np

_ends = np.array([[33, 102, 172], [247, 247, 247], [178, 24, 43]], float)  # blue, white, red: ColorBrewer's RdBu


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(values, largest_size=256):
    """A map of values[y, x], y upwards, 0 white where there are both signs; large ones are thinned."""
    step = max(1, -(-max(values.shape) // largest_size))
    values = values[::step, ::step][::-1]
    low, high = float(values.min()), float(values.max())
    if low < 0 < high:
        high = max(-low, high)
        low = -high
    part = (values - low) / ((high - low) or 1) * 2
    whole = np.minimum(part.astype(int), 1)
    colours = _ends[whole] + (part - whole)[..., None] * (_ends[whole + 1] - _ends[whole])
    rows = np.zeros((values.shape[0], 1 + 3 * values.shape[1]), np.uint8)  # each begins with 0: no filter
    rows[:, 1:] = np.rint(colours).reshape(values.shape[0], -1)
    head = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows.tobytes()))
            + _chunk(b"IEND", b""))


def svg(values, width=320, height=160):
    """A curve, from the lowest to the highest value."""
    low, high = float(values.min()), float(values.max())
    x = np.linspace(4, width - 4, values.size)
    y = height - 4 - (values - low) / ((high - low) or 1) * (height - 8)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    return (f'<svg width="{width}" height="{height}"><polyline points="{points}" fill="none" stroke="#2166ac" '
            'stroke-width="1.5"/></svg>')


def picture(name, values):
    """HTML: the picture under its name and range; of three axes the middle plane."""
    caption = f"{html.escape(name)}: {values.min():.4g} .. {values.max():.4g}"
    if values.ndim == 3:
        values, caption = values[values.shape[0] // 2], caption + ", middle plane"
    if values.ndim == 2:
        code = base64.b64encode(png(values)).decode()
        body = f'<img width="240" style="image-rendering:pixelated" src="data:image/png;base64,{code}"/>'
    else:
        body = svg(values) if values.ndim == 1 else ""
    return f'<figure style="display:inline-block;margin:4px"><figcaption>{caption}</figcaption>{body}</figure>'
