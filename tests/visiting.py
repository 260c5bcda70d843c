"""Visits to served pages in a headless Chromium: how it is started, what is served, what a visit sees."""

import base64
import time
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array

VIEWER = Path(__file__).parents[1] / "workflow" / "viewer"
PIXELS = """async budget => {
  const gl = document.getElementById("picture").getContext("webgl2");
  let width, height, bytes;
  do { // again if the driver took the context away meanwhile
    await davgswt.settle(budget ?? undefined);
    [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  } while (gl.isContextLost());
  let text = "";
  for (let k = 0; k < bytes.length; k += 4096) text += String.fromCharCode(...bytes.subarray(k, k + 4096));
  return [width, height, btoa(text)];
}"""


class Visit:
    """One visit to a page, in a browser profile of its own."""

    def __init__(self, page):
        self.page = page

    def open(self, address: str, wait: bool = True) -> "Visit":
        self.page.goto(address)
        if wait:
            self.page.evaluate("davgswt.ready.then(() => 0)")
        return self

    def until(self, condition: str, seconds: float = 20.0) -> None:
        """Wait for an expression to hold; asked from outside, since the page forbids eval to everybody."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, f"in vain for {seconds} s: {condition}"
            self.page.wait_for_timeout(20)

    @property
    def state(self) -> dict:
        return self.page.evaluate("davgswt.state")

    def at(self, **place) -> Int[Array, "h w 3"]:
        """The picture (rows from the top, RGB bytes) from a place."""
        self.page.evaluate("place => davgswt.set(place)", place)
        return self.picture()

    def picture(self, budget: int | None = None) -> Int[Array, "h w 3"]:
        """What is to be seen here; budget: of Gaussians (default: all)."""
        width, height, text = self.page.evaluate(PIXELS, budget)
        pixels = np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)
        return pixels[::-1, :, :3].astype(int)
