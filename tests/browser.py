"""A browser for the tests: the distribution's own Chromium, in which nothing but this machine can be reached."""

import re
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
HERE = ("127.0.0.1", "localhost")
SLOW = 1000 * 240  # ms: other work may share the machine


def chromium(playwrights_own: str) -> str:
    """The browser's path: the distribution's, else the one that playwright fetched; else the test is skipped."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), playwrights_own)
    return found if Path(found).exists() else pytest.skip("no Chromium is installed: the browser tests are left out")


class Watched:
    """A page with what must not happen on it: requests that leave this machine, and errors on the console."""

    def __init__(self, page):
        self.page, self.away, self.errors = page, [], []
        page.set_default_timeout(SLOW)
        page.route("**/*", self._route)
        page.on("websocket", lambda socket: self._look(socket.url))
        page.on("console", lambda message: message.type == "error" and self.errors.append(message.text))
        page.on("pageerror", lambda error: self.errors.append(str(error)))

    def _look(self, url):
        local = url.startswith(("data:", "blob:", "file:")) or url.split("/")[2].rsplit(":", 1)[0] in HERE
        if not local:
            self.away.append(url)
        return local

    def _route(self, route):
        if self._look(route.request.url):
            route.continue_()
        else:
            route.abort()

    def check(self):
        """Nothing went away, nothing went wrong."""
        assert self.away == []
        assert self.errors == []


def slow_down(page, times=4):
    """The page then computes this many times slower, as on a small laptop."""
    page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": times})


@contextmanager
def browser():
    """A headless Chromium."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no browser test")
    with api.sync_playwright() as playwright:
        path = chromium(playwright.chromium.executable_path)
        started = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield started
        started.close()


def violations(page, *rules):
    """What the accessibility check (axe-core, which comes with its package) finds, as lines to read."""
    from axe_playwright_python.sync_playwright import Axe

    options = {"runOnly": {"type": "rule", "values": list(rules)}} if rules else {}
    found = Axe().run(page, options=options).response["violations"]
    return [f"{v['id']}: {n['html'][:160]} {n['failureSummary'][:200]}" for v in found for n in v["nodes"]]


def press(page, name):
    """Press a button from the keyboard."""
    button = page.get_by_role("button", name=name).first
    button.focus()
    page.keyboard.press("Enter")


def fallen(page):
    """The errors that the bars of the workbench show."""
    return [float(re.match(r"[\d.]+", text)[0]) for text in page.locator(".fall .value").all_inner_texts()]


# what has the focus, as text: through the shadow roots in which the elements of the user interface live
FOCUSED = """() => {
  let at = document.activeElement;
  while (at && at.shadowRoot && at.shadowRoot.activeElement) at = at.shadowRoot.activeElement;
  if (!at) return "";
  const said = ["role", "aria-label", "placeholder", "title"].map(name => at.getAttribute(name) || "");
  return [...said, at.innerText || ""].join(" ");
}"""


def tab_to(page, words, most=80):
    """Press Tab until what has the focus says these words."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if words in page.evaluate(FOCUSED):
            return
    raise AssertionError(f"no Tab leads to '{words}'")
