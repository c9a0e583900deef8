"""Compares two pictures pixel by pixel, in a page of the browser."""

import base64
from dataclasses import dataclass

from tools.browser import Stage

COMPARE = """async (pictures) => {
  const [first, second] = await Promise.all(pictures.map(async (data) => {
    const picture = await createImageBitmap(await (await fetch(data)).blob());
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext('2d');
    context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, picture.width, picture.height).data;
  }));
  const background = first.slice(0, 4);
  let covered = 0, sum = 0, different = 0, largest = 0;
  for (let i = 0; i < first.length; i += 4) {
    const steps = Math.max(...[0, 1, 2].map((k) => Math.abs(first[i + k] - second[i + k])));
    covered += [0, 1, 2].some((k) => first[i + k] !== background[k]);
    sum += steps;
    largest = Math.max(largest, steps);
    different += steps > 8;
  }
  return {
    covered: covered / (first.length / 4), mean: sum / covered,
    different: different / covered, largest,
  };
}"""


@dataclass(frozen=True)
class Difference:
    """The difference of two pictures, in steps of 1/255, by the channel that differs most.

    In the first picture, the model covers the pixels that differ from the first pixel; `covered` is
    their fraction of all pixels. `mean` is the sum of all differences, and `different` the number
    of pixels that differ by more than eight steps; both are divided by the number of covered
    pixels. `largest` is the largest difference.
    """

    covered: float
    mean: float
    different: float
    largest: float


def compare_pictures(stage: Stage, first: bytes, second: bytes) -> Difference:
    """The difference of two PNG files of equal size, computed in a page."""
    urls = [
        f"data:image/png;base64,{base64.b64encode(picture).decode()}" for picture in (first, second)
    ]
    return Difference(**stage.page.evaluate(COMPARE, urls))
