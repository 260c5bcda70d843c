"""How much memory the page takes for a synthetic set of 1.5M Gaussians, all read and drawn, beyond an empty tab's.

In headless Chromium with software rendering, where what a graphics card would hold lies in memory, too: the sum over
the tab's process and the one that draws, of pages that no other process shares. Held is what they have left when the
browser has collected its garbage; the most, what they had at a time, read files and garbage with it. Prints figures,
asserts nothing.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator

import psutil
from fixtures import bundles
from fixtures.browser import FLAGS, chromium_path
from pages import page_of
from record import report_figures

GROUND = bundles.Ground(discs=264, levels=6, speckle=20)
TARGETS = {"page_memory_mb": 300.0}
KINDS = {"renderer": "the tab", "gpu-process": "what draws"}
LONGEST, OFTEN = 120, 0.05  # seconds to wait for the page, between looks
SELDOM = 20  # looks for a reply, for one at the memory
REST = 30  # seconds: a browser collects garbage when it likes, on a quiet machine late
SHOW = """(async () => {
  if (document.readyState !== "complete" || location.protocol === "about:") return null;
  const { ready, viewer } = await import("./main.js");
  await ready;
  for (const yaw of [60, 150, 240, 330]) {
    viewer.setPlace({ yaw });
    await viewer.settle();
  }
  return viewer.state().count;
})()"""


def main() -> int:
    path = chromium_path()
    if path is None:
        print("memory: no chromium on this machine, nothing measured")
        return 0
    from playwright.sync_api import sync_playwright

    with page_of(GROUND) as address, sync_playwright() as playwright:
        empty, _ = measured(playwright, path, "about:blank", "true")
        full, most = measured(playwright, path, f"{address}?still#2,2,1,60,-20", SHOW)
    for kind, name in KINDS.items():
        print(f"  {name}: {full[kind]:.0f} MB, empty {empty[kind]:.0f} MB")
    none = sum(empty.values())
    report_figures({"page_memory_mb": sum(full.values()) - none, "page_memory_most_mb": most - none}, TARGETS)
    return 0


def measured(playwright, path: str, address: str, script: str) -> tuple[dict[str, float], float]:
    """Megabytes that only these processes of a new browser hold, a while after a script of the page came to be true;
    and the most that they held together meanwhile.
    """
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    tab, seen = Tab(browser, address), []

    def look() -> None:
        seen.append(held())

    next(True for _ in looks() if tab.run(script, look))
    for _ in range(REST):
        time.sleep(1)
        look()
    browser.close()
    return seen[-1], max(sum(each.values()) for each in seen)


def held() -> dict[str, float]:
    """By kind of process: megabytes that nobody shares with it."""
    found = dict.fromkeys(KINDS, 0.0)
    for process in psutil.Process().children(recursive=True):
        kind = next((kind for kind in KINDS if f"--type={kind}" in process.cmdline()), None)
        if kind:
            found[kind] += process.memory_full_info().uss / 1e6
    return found


def looks() -> Iterator[None]:
    """A turn every now and then. Raises: TimeoutError: there were enough."""
    end = time.monotonic() + LONGEST
    while time.monotonic() < end:
        yield
        time.sleep(OFTEN)
    raise TimeoutError(f"the page did not answer within {LONGEST} s")


class Tab:
    """A tab that Playwright does not watch: where it does, the browser keeps every file read a second time for it."""

    def __init__(self, browser, address: str):
        self.session, self.replies, self.asked = browser.new_browser_cdp_session(), {}, 0
        self.session.on("Target.receivedMessageFromTarget", self._take)
        context = self.session.send("Target.createBrowserContext")["browserContextId"]
        asked = {"url": address, "browserContextId": context, "width": 480, "height": 270}
        target = self.session.send("Target.createTarget", asked)["targetId"]
        attached = self.session.send("Target.attachToTarget", {"targetId": target, "flatten": False})
        self.id = attached["sessionId"]

    def run(self, script: str, look: Callable[[], None]):
        """An expression's value, awaited; None if the page was left meanwhile. Raises: RuntimeError, TimeoutError.

        look: called now and then while it is awaited.
        """
        self.asked += 1
        told = {"expression": script, "awaitPromise": True, "returnByValue": True}
        message = json.dumps({"id": self.asked, "method": "Runtime.evaluate", "params": told})
        self.session.send("Target.sendMessageToTarget", {"sessionId": self.id, "message": message})
        for count, _ in enumerate(looks()):
            self.session.send("Target.getTargets")  # any question: replies are taken while one waits
            if self.asked in self.replies:
                break
            if count % SELDOM == 0:  # to look holds the page up
                look()
        reply = self.replies.pop(self.asked).get("result", {})
        if "exceptionDetails" in reply:
            raise RuntimeError(reply["exceptionDetails"]["exception"].get("description", "the page failed"))
        return reply.get("result", {}).get("value")

    def _take(self, event: dict) -> None:
        reply = json.loads(event["message"])
        self.replies[reply.get("id")] = reply


if __name__ == "__main__":
    sys.exit(main())
