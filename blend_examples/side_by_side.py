"""Puts two pictures of one scene beside each other, each under its title: side_by_side.py OUT.png (IN.png TITLE)*"""

import sys

import matplotlib.pyplot as plt

picture, *shown = sys.argv[1:]
images = [plt.imread(path) for path in shown[::2]]
height, width = images[0].shape[:2]
dpi, gap, title = 100, 8, 34
whole = (len(images) * width + (len(images) - 1) * gap, height + title)
figure = plt.figure(figsize=(whole[0] / dpi, whole[1] / dpi), dpi=dpi, facecolor="white")
for index, (image, text) in enumerate(zip(images, shown[1::2])):
    left = index * (width + gap)
    figure.figimage(image, left, 0)
    figure.text((left + width / 2) / whole[0], 1 - title / 2 / whole[1], text, ha="center", va="center", fontsize=12)
figure.savefig(picture, pil_kwargs={"optimize": True})
