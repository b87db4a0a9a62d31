#!/usr/bin/env python3
"""Tries the web page in a browser without a screen, as a person would use it, and measures it.

The window is one canvas: what is on it, and where, the page itself tells in words (`sindyscope.described()`), from what it would tell a screen
reader. Everything is done with the mouse and the keyboard.
"""

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

# The bounds of the page, each with what it is measured in.
FIRST_PICTURE = 3.0  # s, from the address to the window
TRANSFERRED = 8.0  # MB, packed, at the first visit
WAIT = 100.0  # ms, until the page's own thread answers, whatever is computed

SAMPLE = Path(__file__).parents[2] / "sample_data" / "friction.csv"


class Window:
    """The window on the page."""

    def __init__(self, page: Page):
        self.page = page

    def things(self):
        """Every labelled thing."""
        return self.page.evaluate("sindyscope.described()")["nodes"]

    def find(self, text, role=None):
        """The things of this label, a pattern for the whole of it; those of the role alone, if one is given."""
        pattern = re.compile(text, re.DOTALL)
        return [t for t in self.things() if pattern.fullmatch(t["text"]) and role in (None, t["role"])]

    def wait(self, text, role=None, seconds=60.0, enabled=False):
        """Waits until there is such a thing."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = [t for t in self.find(text, role) if not (enabled and t["disabled"])]
            if found:
                return found[0]
            time.sleep(0.1)
        shown = sorted({t["text"] for t in self.things()})
        raise SystemExit(f"after {seconds:.0f} s there is no {text!r} on the page, but: {'; '.join(shown)}")

    def gone(self, text, role, seconds):
        """Waits until there is no such thing any more."""
        until = time.monotonic() + seconds
        while self.find(text, role):
            if time.monotonic() > until:
                raise SystemExit(f"after {seconds:.0f} s {text!r} is still on the page")
            time.sleep(0.1)

    def place(self, thing):
        """The middle of a thing, in pixels of the page."""
        zoom = self.page.evaluate("sindyscope.described()")["zoom"]
        x0, y0, x1, y1 = thing["rect"]
        return zoom * (x0 + x1) / 2, zoom * (y0 + y1) / 2

    def click(self, text, role=None, seconds=60.0):
        """Clicks on a thing once it can be clicked."""
        x, y = self.place(self.wait(text, role, seconds, enabled=True))
        self.page.mouse.move(x, y)
        time.sleep(0.15)
        self.page.mouse.down()
        time.sleep(0.05)
        self.page.mouse.up()
        time.sleep(0.3)

    def drag(self, thing, by):
        """Drags what stands in the middle of a thing, so many pixels to the right, in small steps."""
        x, y = thing
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        for step in range(1, 21):
            self.page.mouse.move(x + by * step / 20, y)
            time.sleep(0.03)
        self.page.mouse.up()

    def press(self, key):
        """Presses a key, away from any field."""
        self.page.keyboard.press(key)
        time.sleep(0.3)

    def drop(self, path):
        """Drops a file on the window."""
        script = """async ([name, bytes]) => {
            const data = new DataTransfer();
            data.items.add(new File([Uint8Array.from(bytes)], name));
            const canvas = document.getElementById('window');
            for (const kind of ['dragover', 'drop'])
                canvas.dispatchEvent(new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true }));
        }"""
        self.page.evaluate(script, [path.name, list(path.read_bytes())])


# Notes, since it was asked last, the longest time that the page's thread took to answer a message, and the largest gap between two
# frames. The latter is the picture's way to the screen too: where that is drawn in software, it is long at rest as well.
WATCH = """() => {
    const seen = { wait: 0, gap: 0, at: performance.now() };
    globalThis.seen = seen;
    const frame = now => { seen.gap = Math.max(seen.gap, now - seen.at); seen.at = now; requestAnimationFrame(frame); };
    requestAnimationFrame(frame);
    const { port1, port2 } = new MessageChannel();
    let sent = 0;
    const send = () => { sent = performance.now(); port2.postMessage(0); };
    port1.onmessage = () => { seen.wait = Math.max(seen.wait, performance.now() - sent); setTimeout(send, 5); };
    send();
}"""
AGAIN = "() => { const { wait, gap } = seen; Object.assign(seen, { wait: 0, gap: 0 }); return { wait, gap }; }"


def until_drawn(page):
    """Waits until the window stands where the page said that it was being loaded."""
    page.wait_for_function("!!globalThis.sindyscope && !document.getElementById('said').textContent", timeout=60_000)
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def trial(page, address, pictures):
    """The whole way; gives rows of the table: what, measured, bound."""
    rows = []
    window = Window(page)
    problems = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda said: problems.append(said.text) if said.type == "error" else None)
    network = page.context.new_cdp_session(page)
    network.send("Network.enable")
    sent = []
    network.on("Network.loadingFinished", lambda event: sent.append(event["encodedDataLength"]))

    began = time.monotonic()
    page.goto(address)
    until_drawn(page)
    rows.append(("first picture, s", time.monotonic() - began, FIRST_PICTURE))
    rows.append(("transferred, MB", sum(sent) / 1e6, TRANSFERRED))
    assert page.evaluate("crossOriginIsolated"), "the page is not isolated"
    window.wait("Response", seconds=30)
    pictures("first")
    page.evaluate(WATCH)

    def answers(what):
        seen = page.evaluate(AGAIN)
        rows.append((f"longest wait for an answer {what}, ms", seen["wait"], WAIT))
        rows.append((f"longest gap between frames {what}, ms", seen["gap"], None))

    for move in range(40):
        page.mouse.move(500 + 10 * (move % 20), 300)
        time.sleep(0.1)
    answers("at rest")

    # A file of one's own.
    window.drop(SAMPLE)
    window.wait(r"friction\.csv.*")
    time.sleep(2)
    answers("while a file is read")
    pictures("dropped")

    # A slider that has the whole study done anew.
    before = window.wait("Segment, typed, samples")["value"]
    window.drag(window.place(window.wait("Segment", "Slider")), 20)
    time.sleep(1.5)
    answers("while a slider is dragged")
    after = window.wait("Segment, typed, samples")["value"]
    assert before != after, f"the slider was dragged and the segment is still {after}"

    # A search that is stopped.
    window.press("2")
    window.click("Find what's missing", "Button")
    time.sleep(0.7)
    window.click("Cancel", "Button", seconds=5)
    window.gone("Cancel", "Button", seconds=2)

    # The search, during which the page goes on answering.
    page.evaluate(AGAIN)
    searched = time.monotonic()
    window.click("Find what's missing", "Button", seconds=60)
    moves = 0
    while True:
        # What is on the page is asked for seldom: telling it costs a frame.
        page.mouse.move(500 + 10 * (moves % 20), 300)
        time.sleep(0.1)
        moves += 1
        if moves % 10 == 0 and not window.find("Cancel", "Button"):
            break
        if time.monotonic() - searched > 300:
            pictures("stuck")
            raise SystemExit("the search has not ended within 300 s")
    answers("while it searches")
    rows.append(("search, s", time.monotonic() - searched, None))
    pictures("missing")
    window.wait("A gap beyond noise.*Coulomb.*")
    window.click("Next", "Button")
    pictures("name")
    window.click("Next", "Button")
    window.click("Accept", "Button")
    told = window.wait("Missing: Coulomb .* falls from .*")["text"]
    window.wait("What is left is noise.*")
    pictures("verify")

    # All of it again after a reload.
    time.sleep(2)
    again(page, rows, "the walk again after a reload, s")
    window.wait(r"friction\.csv.*")
    assert window.wait("Missing: .*")["text"] == told, "the walk is another after the reload"

    # A report, by the browser's downloads.
    report = saved(page, window, "4", "Save HTML…", "friction.html")
    assert "<svg" in report and "Coulomb" in report, "the report lacks its figures or what was found"

    # A lesson, and that again too.
    window.press("1")
    window.press("Control+k")
    page.keyboard.type("Lessons")
    time.sleep(0.3)
    window.press("Enter")
    window.click("Begin the lesson Threshold", "Button")
    step = window.wait(r"step 1 of \d+")["text"]
    pictures("lesson")
    time.sleep(2)
    again(page, rows, "the lesson again after a reload, s")
    window.wait("Lesson: Threshold")
    window.wait(step)
    window.click("Leave", "Button")

    # The virtual rig, in the dark.
    window.press("3")
    window.wait("TRUTH BESIDE FOUND")
    window.click("Rig")
    page.emulate_media(color_scheme="dark")
    time.sleep(2)
    pictures("dark")
    return rows, problems


def again(page, rows, what):
    """Loads the page again."""
    began = time.monotonic()
    page.reload()
    until_drawn(page)
    rows.append((what, time.monotonic() - began, FIRST_PICTURE))


def saved(page, window, room, button, name):
    """The text of a file that is saved in a room."""
    window.press(room)
    window.click(button, "Button")
    window.wait("Name", "TextInput")
    page.keyboard.press("Control+a")
    page.keyboard.type(name)
    with page.expect_download(timeout=60_000) as download:
        page.keyboard.press("Enter")
    assert download.value.suggested_filename == name, download.value.suggested_filename
    return Path(download.value.path()).read_text(encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--page", required=True)
    parser.add_argument("--browser", required=True)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    server = subprocess.Popen([options.program, "serve", "--port", "0", options.page], stdout=subprocess.PIPE, text=True)
    try:
        address = re.search(r"http://\S+", server.stdout.readline())[0]
        with sync_playwright() as playwright:
            # Drawn in software, as on a machine without a display.
            browser = playwright.chromium.launch(
                executable_path=options.browser,
                args=["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
            )
            page = browser.new_page(viewport={"width": 1280, "height": 800})

            def pictures(name):
                if options.pictures:
                    options.pictures.mkdir(parents=True, exist_ok=True)
                    page.screenshot(path=options.pictures / f"{name}.png")

            rows, problems = trial(page, address, pictures)
            browser.close()
    finally:
        server.terminate()
    failed = bool(problems)
    for what, measured, bound in rows:
        told = "" if bound is None else f"at most {bound:g}" + ("" if measured <= bound else "  TOO MUCH")
        failed |= bound is not None and measured > bound
        print(f"{what:58} {measured:8.2f}  {told}")
    for problem in problems:
        print(f"the page complains: {problem}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
