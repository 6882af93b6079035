"""A reader of Radiance files, by the text of the format, that takes numbers as engines do."""

import numpy as np


def decoded_hdr(content):
    """Linear RGB, row 0 at the bottom, and the lines of the header (G. Ward, "Real Pixels", 1991)."""
    header, _, rest = content.partition(b"\n\n")
    size, _, data = rest.partition(b"\n")
    assert size.split()[::2] == [b"-Y", b"+X"]
    height, width = map(int, size.split()[1::2])
    data, at, lines = np.frombuffer(data, np.uint8), 0, []
    for _ in range(height):
        if not 8 <= width < 32768:
            lines.append(data[at : at + 4 * width].reshape(width, 4))
            at += 4 * width
            continue
        assert data[at : at + 4].tolist() == [2, 2, width >> 8, width & 255]
        at, channels = at + 4, []
        for _ in range(4):
            numbers = []
            while len(numbers) < width:
                count = int(data[at])
                is_run = count > 128
                numbers += [data[at + 1]] * (count - 128) if is_run else data[at + 1 : at + 1 + count].tolist()
                at += 2 if is_run else 1 + count
            channels.append(numbers)
        lines.append(np.array(channels).T)
    assert at == len(data)
    texels = np.array(lines, float)[::-1]
    return texels[..., :3] * 2.0 ** (texels[..., 3:] - 136), header.split(b"\n")
