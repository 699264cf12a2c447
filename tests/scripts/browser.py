"""A report in headless Chromium: links, pictures, sorting, filters, no errors, no sideways scroll.

    python3 tests/scripts/browser.py REPORT_FOLDER [--pages N]

Speaks the DevTools protocol over a pipe, so that nothing but Python and Chromium is needed. Every
page is opened 390 px and 1600 px wide, light and dark. Prints what is wrong, one line each, and ends with
code 1 if anything is; prints the time in which index.html was there.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.parse

SIZES = [(390, 844), (1600, 1000)]
SCHEMES = ["light", "dark"]
BROWSERS = ["chromium", "chromium-browser", "google-chrome", "chrome"]


class Browser:
    """One page of one browser."""

    def __init__(self, program):
        self.profile = tempfile.mkdtemp()
        (to_read, self.to_write), (self.from_read, to_answer) = os.pipe(), os.pipe()
        flags = [
            "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync", "--disable-quic",
            "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe",
            f"--user-data-dir={self.profile}", "about:blank",
        ]
        # Chromium reads commands from descriptor 3 and answers on 4.
        shell = f'exec 5<&{to_read} 6>&{to_answer}; exec 3<&5 4>&6 5<&- 6>&-; exec "$0" "$@"'
        self.process = subprocess.Popen(
            ["bash", "-c", shell, program, *flags], pass_fds=(to_read, to_answer),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(to_read), os.close(to_answer)
        self.buffer, self.number, self.events = b"", 0, []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = None
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.ask(f"{domain}.enable")

    def message(self):
        while b"\0" not in self.buffer:
            part = os.read(self.from_read, 1 << 20)
            if not part:
                raise SystemExit("the browser ended")
            self.buffer += part
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def ask(self, method, **params):
        self.number += 1
        command = {"id": self.number, "method": method, "params": params}
        if getattr(self, "session", None):
            command["sessionId"] = self.session
        os.write(self.to_write, json.dumps(command).encode() + b"\0")
        while True:
            answer = self.message()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise SystemExit(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def run(self, expression):
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise SystemExit(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def open(self, path, size, scheme):
        """Seconds until the page is loaded, and what it complained of."""
        width, height = size
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.events.clear()
        began = time.monotonic()
        self.ask("Page.navigate", url=path.resolve().as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self.message())
        self.run("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
        return time.monotonic() - began

    def complaints(self):
        found = []
        for event in self.events:
            method, params = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append("exception: " + params["exceptionDetails"].get("text", ""))
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
                found.append("console: " + str(params["args"]))
            elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
                found.append("log: " + params["entry"]["text"])
            elif method == "Network.requestWillBeSent":
                url = params["request"]["url"]
                if not url.startswith(("file:", "data:", "about:")):
                    found.append("asks a network for " + url)
        return found

    def close(self):
        self.process.terminate()
        self.process.wait()
        shutil.rmtree(self.profile, ignore_errors=True)


# Every element with text of its own: its colour against the nearest background, by WCAG.
CONTRAST = """(() => {
  const parse = (text) => (text.match(/[\\d.]+/g) ?? []).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const c = parse(getComputedStyle(e).backgroundColor);
      if (c.length === 3 || c[3] > 0) return c;
    }
    return [255, 255, 255];
  };
  const bad = [];
  for (const e of document.body.querySelectorAll("*")) {
    if (e.closest("svg, script, noscript") || ![...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim())) continue;
    const [a, b] = [light(parse(getComputedStyle(e).color)), light(behind(e))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) bad.push(`${e.tagName} "${e.textContent.trim().slice(0, 30)}" ${ratio.toFixed(1)}`);
  }
  return bad.slice(0, 3);
})()"""

PICTURES = """(async () => {
  const images = [...document.images];
  for (const image of images) { image.loading = "eager"; }
  await Promise.all(images.map((image) => image.decode().catch(() => {})));
  return images.filter((image) => !(image.complete && image.naturalWidth > 0)).map((image) => image.src);
})()"""

# Of links within a picture `href` is no text.
LINKS = (
    "[...document.querySelectorAll('a[href]')]"
    ".map((a) => new URL(a.getAttribute('href'), document.baseURI).href)"
)


def check_page(browser, path, wrong):
    for size in SIZES:
        for scheme in SCHEMES:
            name = f"{path.name} {size[0]} px {scheme}"
            browser.open(path, size, scheme)
            broken = browser.run(PICTURES)
            over = browser.run("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            if over > 0:
                wrong.append(f"{name}: {over} px wider than the window")
            wrong.extend(f"{name}: no picture {picture}" for picture in broken)
            wrong.extend(f"{name}: low contrast {what}" for what in browser.run(CONTRAST))
            wrong.extend(f"{name}: {complaint}" for complaint in browser.complaints())
    for link in browser.run(LINKS):
        url = urllib.parse.urlparse(link)
        target = pathlib.Path(urllib.parse.unquote(url.path))
        if url.scheme != "file":
            wrong.append(f"{path.name}: leads out of the folder: {link}")
        elif not target.exists():
            wrong.append(f"{path.name}: leads nowhere: {link}")
        elif url.fragment and f'id="{url.fragment}"' not in target.read_text(encoding="utf-8"):
            wrong.append(f"{path.name}: no such place: {link}")


ROWS = "document.querySelectorAll('table.sortable tbody tr').length"


def press(browser, key):
    code = {"Enter": ("Enter", 13, "\r")}[key]
    for kind in ["keyDown", "keyUp"]:
        browser.ask("Input.dispatchKeyEvent", type=kind, key=code[0], code=code[0], windowsVirtualKeyCode=code[1], text=code[2] if kind == "keyDown" else "")


def check_table(browser, index, wrong):
    browser.open(index, SIZES[1], "light")
    data = "JSON.parse(document.getElementById('cells-data').textContent)"
    n = browser.run(f"{data}.rows.length")
    step = browser.run(f"{data}.step")
    if browser.run(ROWS) != min(n, step):
        wrong.append(f"{browser.run(ROWS)} rows without a script, expected {min(n, step)}")
    # The filter: typed as a user types it.
    first = browser.run("document.querySelector('table.sortable tbody a').textContent")
    browser.run("document.getElementById('filter').focus()")
    browser.ask("Input.insertText", text=first)
    expected = browser.run(
        f"{data}.rows.filter((r) => r.fields.map((f) => Array.isArray(f) ? f[1] : f).join(' ').toLowerCase()"
        f".includes({json.dumps(first.lower())})).length"
    )
    if browser.run(ROWS) != min(expected, step) or not 0 < expected:
        wrong.append(f"filter {first!r}: {browser.run(ROWS)} rows, expected {expected}")
    said = browser.run("document.getElementById('shown').textContent")
    if f"of {expected} " not in said:
        wrong.append(f"filter {first!r}: says {said!r}, expected {expected}")
    browser.run("filter.value = 'no such cell'; filter.dispatchEvent(new Event('input'))")
    if browser.run(ROWS) != 0:
        wrong.append("a filter that nothing matches leaves rows")
    browser.run("filter.value = ''; filter.dispatchEvent(new Event('input'))")
    # Each verdict alone: as many rows as the choice says.
    for option in browser.run("[...document.querySelectorAll('#verdict option')].slice(1).map((o) => [o.value, o.textContent])"):
        browser.run(f"verdict.value = {json.dumps(option[0])}; verdict.dispatchEvent(new Event('change'))")
        said = int(option[1].rsplit(" ", 1)[1])
        if browser.run(ROWS) != min(said, step):
            wrong.append(f"verdict {option[1]}: {browser.run(ROWS)} rows")
    browser.run("verdict.value = ''; verdict.dispatchEvent(new Event('change'))")
    # Every column both ways, by the keyboard.
    n_columns = browser.run("document.querySelectorAll('table.sortable thead th').length")
    for column in range(n_columns):
        for direction in ["descending", "ascending"]:
            browser.run(f"document.querySelectorAll('table.sortable thead th button')[{column}].focus()")
            press(browser, "Enter")
            got = browser.run(f"document.querySelectorAll('table.sortable thead th')[{column}].getAttribute('aria-sort')")
            if got != direction:
                wrong.append(f"column {column}: sorted {got}, expected {direction}")
            if not browser.run(f"""(() => {{
                const keys = order.slice(0, {step}).map((row) => keyOf(row.fields[{column}])).filter((key) => key !== null);
                const least = (a, b) => typeof a === "number" ? a - b : a.localeCompare(b, "en", {{ numeric: true }});
                const sign = {1 if direction == "ascending" else -1};
                const shown = [...document.querySelectorAll('table.sortable tbody tr')].map((tr) => tr.cells[{column}].textContent);
                return keys.every((key, k) => k === 0 || sign * least(keys[k - 1], key) <= 0)
                  && shown.every((text, k) => text === textOf(order[k].fields[{column}]));
            }})()"""):
                wrong.append(f"column {column}: not {direction}")
    # More rows on demand.
    if n > step:
        browser.run("document.getElementById('more').click()")
        if browser.run(ROWS) != min(n, 2 * step):
            wrong.append(f"show more: {browser.run(ROWS)} rows")
    wrong.extend(f"table: {complaint}" for complaint in browser.complaints())


def check_alone(browser, index, wrong):
    """index.html as a mail attachment: the answer and its picture are there without any other file."""
    with tempfile.TemporaryDirectory() as folder:
        alone = pathlib.Path(folder) / "index.html"
        shutil.copy(index, alone)
        browser.open(alone, SIZES[0], "light")
        if not browser.run("document.querySelectorAll('.answer li').length >= 2"):
            wrong.append("alone: no answer")
        # Of the layouts for narrow and wide windows one is shown.
        size = browser.run(
            "[...document.querySelectorAll('.embedded svg')].map((svg) => svg.getBoundingClientRect())"
            ".map(({width, height}) => [width, height]).find(([width]) => width > 0) ?? [0, 0]"
        )
        if min(size) < 100:
            wrong.append(f"alone: the picture of the answer is {size} px")


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--pages", type=int, default=4, help="pages of cells to open")
    arguments = arguments.parse_args()
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        print("SKIPPED: no Chromium")
        return 0
    index = arguments.folder / "index.html"
    browser, wrong = Browser(program), []
    try:
        browser.open(index, SIZES[1], "light")
        print(f"index.html: {browser.open(index, SIZES[1], 'light'):.2f} s")
        pages = [index, *sorted(arguments.folder.glob("factors/*.html")), *sorted(arguments.folder.glob("timing*.html"))]
        pages += sorted(arguments.folder.glob("cells/*.html"))[: arguments.pages]
        for page in pages:
            check_page(browser, page, wrong)
        check_table(browser, index, wrong)
        check_alone(browser, index, wrong)
    finally:
        browser.close()
    print(f"{len(pages)} pages, {len(SIZES) * len(SCHEMES)} views each: {len(wrong)} wrong")
    for line in wrong:
        print(line)
    return 1 if wrong else 0


sys.exit(main())
