"""Two pictures of a page, compared pixel by pixel: the browser decodes them."""

import base64
from dataclasses import dataclass

from tests.web.browser import Stage

COMPARE = """async (pictures) => {
  const [one, other] = await Promise.all(pictures.map(async (data) => {
    const picture = await createImageBitmap(await (await fetch(data)).blob());
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext('2d');
    context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, picture.width, picture.height).data;
  }));
  const empty = one.slice(0, 4);
  let inside = 0, sum = 0, apart = 0, most = 0;
  for (let i = 0; i < one.length; i += 4) {
    const steps = Math.max(...[0, 1, 2].map((k) => Math.abs(one[i + k] - other[i + k])));
    const drawn = [0, 1, 2].some((k) => one[i + k] !== empty[k]);
    inside += drawn;
    sum += steps;
    most = Math.max(most, steps);
    apart += steps > 8;
  }
  return { inside: inside / (one.length / 4), mean: sum / inside, apart: apart / inside, most };
}"""


@dataclass(frozen=True)
class Difference:
    """The difference of two pictures, in steps of 1/255, by the channel that differs most.

    `inside`: share of the pixels that are not of the background of the first picture, by its first
    pixel; `mean` of the difference over these; `apart`: share of them that differ by more than
    eight steps; `most`: the largest of all.
    """

    inside: float
    mean: float
    apart: float
    most: float


def compare_pictures(stage: Stage, one: bytes, other: bytes) -> Difference:
    """The difference of two PNG files of one size, computed in a page."""
    pictures = [f"data:image/png;base64,{base64.b64encode(p).decode()}" for p in (one, other)]
    return Difference(**stage.page.evaluate(COMPARE, pictures))
