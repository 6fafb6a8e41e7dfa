"""The explorer in a real browser: sliders move, verdicts follow, and the file is saved."""

from __future__ import annotations

import json
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest
from browsing import CUT_OFF, DESKTOP, PHONE, Browser, contrast
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement

from slewctl.files import read_design
from slewctl.gate import check_file

DESIGNS = Path(__file__).parents[2] / "designs"
# The widgets stand in shadow trees, the results in a frame.
DEEP = """
const all = (root, selector) => [...root.querySelectorAll(selector),
  ...[...root.querySelectorAll("*")].flatMap((e) => e.shadowRoot ? all(e.shadowRoot, selector) : [])];
const frame = all(document, "iframe")[0]?.contentDocument;
"""
STATE = "return frame?.querySelector('.state')?.textContent"
# What sliders are set to, by their names.
TOLD = (
    "return Object.fromEntries(all(document, '.noUi-handle')"
    ".map((h) => [h.ariaLabel, h.ariaValueText]))"
)
CONFIRMED = "return frame?.querySelector('.state')?.dataset.confirmed === 'yes'"
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("explorer")]


@contextmanager
def serving(path: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Serve the explorer of a design in a process of its own; Ctrl-C ends it without a word."""
    command = [sys.executable, "-m", "slewctl", "explore", str(path), "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as p:
        try:
            assert p.stdout is not None
            line = p.stdout.readline()
            assert "(Ctrl-C ends it)" in line, line + p.stdout.read()
            yield line.split()[1], p
            p.send_signal(signal.SIGINT)
            assert p.communicate(timeout=30)[0] == ""
            assert p.returncode == 0
        finally:
            p.kill()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("designs")
    shutil.copy(DESIGNS / "06-sampled-lqg-with-delay.toml", folder)
    smaller = (DESIGNS / "12-any-payload.toml").read_text()
    for old, new in (("\nn = 2\n", "\nn = 1\n"), ("orders = [1, 2]", "orders = [1]")):
        assert old in smaller
        smaller = smaller.replace(old, new)
    (folder / "any-payload.toml").write_text(smaller)
    return folder


@pytest.fixture(scope="module")
def served(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A design by matrix inequalities, served to several pages."""
    with serving(folder / "any-payload.toml") as found:
        yield found


class Page:
    """The explorer as a person sees it."""

    def __init__(self, browser: Browser, address: str, width: int, scheme: str) -> None:
        self.browser = browser
        browser.driver.get_log("browser")
        browser.driver.get_log("performance")
        browser.driver.get("about:blank")
        browser.untouched = ""
        browser.command("Emulation.setEmulatedMedia", media="screen",
                        features=[{"name": "prefers-color-scheme", "value": scheme}])  # fmt: skip
        browser.command("Emulation.setDeviceMetricsOverride", width=width, height=900,
                        deviceScaleFactor=1, mobile=width != DESKTOP)  # fmt: skip
        browser.driver.get(address)

    def run(self, script: str, *arguments: Any) -> Any:
        return self.browser.run(DEEP + script, *arguments)

    def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + 90
        while not holds():
            assert time.monotonic() < end, self.run(STATE)
            time.sleep(0.2)  # to look costs as much as what is waited for

    def confirmed(self) -> None:
        self.until(lambda: self.run(CONFIRMED))

    def slider(self, label: str) -> WebElement:
        found = self.run(
            "return all(document, '.noUi-handle').filter((h) =>"
            " all(h.getRootNode().host.getRootNode(), 'div')"
            ".some((d) => d.textContent.startsWith(arguments[0])))",
            label,
        )
        (handle,) = found
        return handle

    def move(self, label: str, *keys: str) -> None:
        before = self.run(STATE)
        self.slider(label).send_keys(*keys)
        self.until(lambda: self.run(STATE) != before)

    def press(self, name: str) -> None:
        (button,) = self.run(
            "return all(document, 'button').filter((b) => b.textContent === arguments[0])", name
        )
        button.click()

    def told(self, text: str) -> bool:
        return bool(
            self.run(
                "return all(document, 'div').some((d) => d.textContent.includes(arguments[0]))",
                text,
            )
        )


def test_sliders_move_the_design_and_it_is_saved(browser: Browser, folder: Path) -> None:
    path = folder / "06-sampled-lqg-with-delay.toml"
    with serving(path) as (address, _):
        page = Page(browser, address, DESKTOP, "light")
        page.confirmed()
        assert page.run("return frame.querySelectorAll('figure').length") == 8  # ladder and all
        # What is enlarged stays so, and what is hidden stays hidden.
        page.run("frame.querySelector('figure .tools button').click()")
        page.run("frame.querySelector('.legend input').click()")
        axis = "return frame.querySelector('figure .marks').textContent"
        enlarged = page.run(axis)
        page.move("largest voltage", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
        assert page.run(axis) == enlarged
        assert page.run("return frame.querySelector('[data-names]').className") == "off0"
        page.confirmed()
        page.press("Save")
        page.until(lambda: page.told("Next: slewctl check"))
        saved = folder / "06-sampled-lqg-with-delay-explored.toml"
        assert read_design(saved).case.objective.limits["voltage"] == 10.1
        assert "# In seconds: the voltage computed" in saved.read_text()
        shown = page.run(
            "return [...frame.querySelectorAll('td:nth-child(2)')].map((d) => d.innerText)"
        )
        found = check_file(saved).findings
        assert shown[1] == f"{found[1].verdict.value:.4g} dB"
        page.press("Back to the file")
        page.until(lambda: page.told("largest voltage: 8 V"))
        # Saved again over what was saved here, and never over anything else.
        page.press("Save")
        page.until(lambda: read_design(saved).case.objective.limits["voltage"] == 8.0)
        field = page.run("return all(document, 'input[type=text]')[0]")
        for name, refusal in (
            (path.name, "exists already; give another name"),
            ("../beyond.toml", "is no name of a TOML file"),
            ("-x.toml", "is no name of a TOML file"),
        ):
            field.clear()
            field.send_keys(name + Keys.ENTER)
            page.press("Save")
            page.until(lambda name=name, refusal=refusal: page.told(f"{name}: {refusal}"))
        assert not (folder.parent / "beyond.toml").exists()
        # A file that somebody has changed meanwhile is theirs.
        saved.write_text(saved.read_text() + "# mine\n")
        field.clear()
        field.send_keys(saved.name + Keys.ENTER)
        page.press("Save")
        page.until(lambda: page.told(f"{saved.name}: exists already"))
        assert saved.read_text().endswith("# mine\n")
        loud = [e for e in browser.driver.get_log("browser") if e["level"] == "SEVERE"]
        assert loud == []
        assert asked(browser) <= {address.removeprefix("http://").rstrip("/")}


def test_controls_have_names_and_a_solver_is_awaited(
    browser: Browser, served: tuple[str, subprocess.Popen[str]]
) -> None:
    address, _ = served
    page = Page(browser, address, DESKTOP, "light")
    page.confirmed()
    # Every control has a name, and every slider says in words what it is set to.
    names = controls(browser)
    assert len(names) == 10
    assert all(names)
    assert {"basis", "hub inertia", "functions n", "largest torque"} <= set(names)
    told = page.run(TOLD)
    assert set(told) == {*names} - {"basis"}
    assert all(told.values())
    assert (told["largest torque"], told["sample time"]) == ("1 N·m", "continuous")
    page.run(
        "const main = frame.querySelector('main'); top.told = [];"
        "new MutationObserver(() => top.told.push(main.ariaBusy))"
        ".observe(main, { attributes: true })"
    )
    page.slider("largest torque").send_keys(Keys.ARROW_RIGHT)
    page.until(lambda: page.run("return top.told.length") >= 2)
    assert page.run("return top.told")[:2] == ["true", None]
    page.until(lambda: page.run(TOLD)["largest torque"] == "1.12 N·m")


def test_what_cannot_be_designed_is_told_and_left_again(
    browser: Browser, served: tuple[str, subprocess.Popen[str]]
) -> None:
    address, process = served
    page = Page(browser, address, PHONE, "dark")
    page.confirmed()
    page.run("frame.querySelector('figure .tools button').click()")
    axis = "return frame.querySelector('figure .marks').textContent"
    enlarged = page.run(axis)
    assert page.run("return document.documentElement.scrollWidth") <= PHONE
    assert page.run("return frame.documentElement.scrollWidth") <= PHONE
    assert page.run(CUT_OFF.replace("document", "frame"), "html, .state, figcaption") == []
    page.move("dead time of the drive", Keys.ARROW_RIGHT)
    assert "No design with these settings" in page.run(STATE)
    assert "a dead time, which this does not take into account" in page.run(
        "return frame.querySelector('main').textContent"
    )
    page.move("dead time of the drive", Keys.ARROW_LEFT)
    page.confirmed()
    assert page.run(axis) == enlarged
    # Another process takes the place of one that is killed.
    for child in psutil.Process(process.pid).children(recursive=True):
        if "spawn_main" in " ".join(child.cmdline()):
            child.kill()
    page.move("largest torque", Keys.ARROW_RIGHT)
    page.confirmed()
    # A continuous design has no clock whose delay could be set.
    greyed = "return all(document, '.noUi-target').map((s) => s.hasAttribute('disabled'))"
    assert page.run(greyed) == [False] * 8 + [True]
    page.slider("sample time").send_keys(Keys.ARROW_RIGHT)
    page.until(lambda: not any(page.run(greyed)))
    # On a dark screen the controls can be read, too.
    for ink, ground in page.run(
        "return all(document, '.bk-clearfix, label').map((e) => [getComputedStyle(e).color,"
        " getComputedStyle(document.body).backgroundColor])"
    ):
        assert contrast(ink, ground) >= 7


def controls(browser: Browser) -> list[str]:
    """Return the names of sliders and choices, as a screen reader is given them."""
    browser.command("Accessibility.enable")
    nodes = browser.command("Accessibility.getFullAXTree")["nodes"]
    kinds = ("slider", "combobox")
    return [node["name"]["value"] for node in nodes if node["role"]["value"] in kinds]


def test_it_listens_at_this_machine_and_to_its_own_page_alone(
    served: tuple[str, subprocess.Popen[str]],
) -> None:
    address, process = served
    tree = [process.pid, *(c.pid for c in psutil.Process(process.pid).children(recursive=True))]
    open_at = {
        link.laddr.ip
        for link in psutil.net_connections("inet")
        if link.pid in tree and link.status == psutil.CONN_LISTEN
    }
    assert open_at == {"127.0.0.1"}
    host, port = address.removeprefix("http://").rstrip("/").split(":")
    token = session(address)
    for origin, answer in ((address.rstrip("/"), b"101"), ("http://elsewhere.example", b"403")):
        with socket.create_connection((host, int(port))) as link:
            link.sendall(
                f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: {origin}\r\n"
                "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                f"Sec-WebSocket-Protocol: bokeh, {token}\r\n\r\n".encode()
            )
            assert link.recv(64).split()[1] == answer


def session(address: str) -> str:
    """Return the token of a session, as the page itself holds it."""
    from urllib.request import urlopen

    with urlopen(address) as page:
        text = page.read().decode()
    return str(text.partition('"token":"')[2].partition('"')[0])


def asked(browser: Browser) -> set[str]:
    """Return the hosts that the page asked for anything."""
    hosts = set()
    for entry in browser.driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            if url.startswith(("http", "ws")):
                hosts.add(url.split("/")[2])
    return hosts
