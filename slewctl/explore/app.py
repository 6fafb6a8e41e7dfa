"""The explorer's page: sliders beside verdicts and curves, served to this machine alone."""

from __future__ import annotations

import logging
import os
import shlex
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from functools import cache
from html import escape
from multiprocessing import active_children
from pathlib import Path
from typing import Any, Self

import panel as pn

from slewctl.compare import CaseResult, Judge
from slewctl.compare.study.processes import Processes
from slewctl.errors import InputError, SlewctlError
from slewctl.explore.changed_file import changed_text
from slewctl.explore.knobs import DELAY, SAMPLE_TIME, Knob, Value, knobs_of
from slewctl.explore.page import PAGE, Results
from slewctl.explore.result import Explored, before, explored, seen_ladder, set_as
from slewctl.files import DesignFile, design_of_text, read_design
from slewctl.report.explorer import explorer_page, explorer_refusal, with_ladder
from slewctl.textfile import read_bytes, write_bytes

LOCAL = "127.0.0.1"
"""The only address that is listened at: nothing of the page leaves this machine."""
# They tell of every page that is closed, or refused.
_TALKATIVE = ("bokeh.server.views.ws", "tornado.access", "asyncio")
# Of a file's name, in characters; file systems take 255 bytes.
_LONGEST = 100
# In ms: as many moves of a slider as come within it are one.
_PAUSE = 20
# By how much what is confirmed stands behind what is seen at once, in steps of the system.
_BEHIND = 10
# In pixels: the column of controls, and what is in it.
_WIDTH, _INNER = 320, 290


def serve(path: Path, *, port: int = 0, show: bool = True, ready: Callable[[str], None]) -> None:
    """Serve the explorer of a design until it is interrupted.

    Parameters
    ----------
    path : Path
        The design file.
    port : int
        Zero for any that is free.
    show : bool
        Whether a browser is opened.
    ready : callable
        Called with the address once there is something to be seen.

    Raises
    ------
    SlewctlError
        If the design cannot be judged as it is, or the port is taken.
    """
    design = read_design(path)
    with design.source.computing():
        knobs = knobs_of(design, Judge(design.case).truth)
    beside = before(design)
    for name in _TALKATIVE:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with Shared(design, knobs, beside) as shared:
        for begin in (shared.climb, shared.confirm):  # starts the processes, which load
            begin(design.source.text)
        try:
            server = pn.serve(
                {"/": lambda: Session(shared).view()},
                address=LOCAL,
                port=port,
                show=False,
                start=False,
                title=f"{design.case.name}: explorer",
                verbose=False,
            )
        except OSError as error:
            raise InputError(
                f"cannot be listened at: {error.strerror}", where="--port", remedy="give another"
            ) from error
        server.start()
        ready(f"http://{LOCAL}:{server.port}/")
        if show:
            server.show("/")
        try:
            server.io_loop.start()
        finally:
            server.stop()


class Shared:
    """What all visitors of the page have in common, and where verdicts are confirmed.

    Parameters
    ----------
    design : DesignFile
    knobs : tuple of Knob
    beside : CaseResult or None
        The design of the file as it is.
    """

    def __init__(
        self, design: DesignFile, knobs: tuple[Knob, ...], beside: CaseResult | None
    ) -> None:
        self.design, self.knobs, self.beside = design, knobs, beside
        # Processes of their own, so that the sliders never wait for them.
        self._confirming, self._climbing = _Aside(), _Aside()
        # What was asked last: every page begins with the file as it is.
        self._asked: tuple[str, Future[str]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in active_children():  # what is being confirmed is not waited for
            process.terminate()
        for aside in (self._confirming, self._climbing):
            aside.end()

    def climb(self, text: str) -> Future[str]:
        """Have the ladder of a first look at a text drawn."""
        return self._climbing.submit(_climbed, *self._given(text))

    def confirm(self, text: str) -> Future[str]:
        """Have the gate's verdicts on a text made into a part of the page."""
        if self._asked is not None:
            last, answer = self._asked
            if text == last and not (answer.done() and (answer.cancelled() or answer.exception())):
                return answer
        answer = self._confirming.submit(_confirmed, *self._given(text))
        self._asked = text, answer
        return answer

    def _given(self, text: str) -> tuple[str, Path, str, str]:
        own = self.design
        return text, own.path, own.case.name, own.source.text


class _Aside:
    """A process beside this one, and another in its place where somebody has killed it."""

    def __init__(self) -> None:
        self._pool = Processes(1)

    def submit(self, function: Callable[..., str], *given: Any) -> Future[str]:
        """Hand out a call."""
        try:
            return self._pool.submit(function, *given)
        except BrokenExecutor:
            self.end(wait=False)
            self._pool = Processes(1)
            return self._pool.submit(function, *given)

    def end(self, wait: bool = True) -> None:
        """End it; what was handed out is cancelled, or done first."""
        self._pool.shutdown(wait=wait, cancel_futures=True)


class Session:
    """One visitor's settings, and what they give.

    Parameters
    ----------
    shared : Shared
    """

    def __init__(self, shared: Shared) -> None:
        self.shared = shared
        self.own = {knob.key: knob.value for knob in shared.knobs}
        self.widgets = {knob.key: _widget(knob) for knob in shared.knobs}
        self.results = Results(page=explorer_page(), sizing_mode="stretch_both")
        self.name = pn.widgets.TextInput(
            name="Save as design file",
            width=_INNER,
            value=f"{shared.design.path.stem}-explored.toml",
        )
        self.told = pn.pane.HTML("", width=_INNER, styles={"overflow-wrap": "anywhere"})
        self.found: Explored | None = None
        self.saved: dict[Path, bytes] = {}
        self.waiting: Future[str] | None = None
        # What is on the page without its ladder, and the ladder of it.
        self.climbing: tuple[str, Future[str]] | None = None
        self.scheduled = False
        self.document: Any = None

    def view(self) -> pn.Template:
        """Return the page."""
        self.document = pn.state.curdoc
        for widget in self.widgets.values():
            widget.param.watch(self._turned, "value")
        reset = pn.widgets.Button(name="Back to the file", width=_INNER)
        reset.on_click(lambda _: self._reset())
        save = pn.widgets.Button(name="Save", button_type="primary", width=_INNER)
        save.on_click(lambda _: self._save())
        self._show()
        controls = [*self.widgets.values(), reset, self.name, save, self.told]
        beside = {"flex": "1 1 24rem", "min-width": "min(20rem, 100%)", "height": "97vh"}
        page = pn.Template(PAGE)
        page.add_panel(
            "page",
            pn.FlexBox(
                pn.Column(*controls, width=_WIDTH),
                pn.Column(self.results, sizing_mode="stretch_both", styles=beside),
                flex_wrap="wrap",
                sizing_mode="stretch_width",
            ),
        )
        return page

    @property
    def settings(self) -> dict[str, Value]:
        """What is set otherwise than in the file; no delay without a clock."""
        now = {key: widget.value for key, widget in self.widgets.items()}
        if not now.get(SAMPLE_TIME, 1.0):
            now.pop(DELAY, None)
        return {key: value for key, value in now.items() if value != self.own[key]}

    def _turned(self, _: object) -> None:
        """Look again soon: what comes meanwhile is looked at together."""
        if not self.scheduled:
            self.scheduled = self.results.busy = True
            self.document.add_timeout_callback(self._show, _PAUSE)

    def _show(self) -> None:
        self.scheduled = False
        if self.climbing is not None:
            self.climbing[1].cancel()
            self.climbing = None
        if DELAY in self.widgets:
            self.widgets[DELAY].disabled = not self.widgets[SAMPLE_TIME].value
        shared = self.shared
        try:
            design = set_as(shared.design, self.settings)
            ladder = shared.climb(design.source.text)
            self.found = explored(design, beside=shared.beside, confirm=False, ladder=False)
            body = self.found.body()
        except SlewctlError as error:
            self.found = None
            self._put(explorer_refusal(str(error)))
            return
        self._put(body)
        self.climbing = body, ladder
        ladder.add_done_callback(lambda done: self._next(lambda: self._climbed(done)))
        if self.waiting is None:
            self._confirm(self.found.text)

    def _put(self, body: str) -> None:
        self.results.param.update(body=body, busy=False)

    def _climbed(self, done: Future[str]) -> None:
        """Put the ladder on the page, if nothing has been set meanwhile."""
        if self.climbing is None or self.scheduled:
            return
        body, ladder = self.climbing
        # Of a process that was killed the ladder comes with what is confirmed.
        if ladder is done and not done.cancelled() and not done.exception():
            self._put(with_ladder(body, done.result()))

    def _confirm(self, text: str) -> None:
        """Have what is shown confirmed; what is set meanwhile is confirmed next."""
        self.waiting = self.shared.confirm(text)
        self.waiting.add_done_callback(lambda done: self._next(lambda: self._arrived(text, done)))

    def _next(self, call: Callable[[], None]) -> None:
        """Have the page's own thread call something, unless the page has been left."""
        try:
            self.document.add_next_tick_callback(call)
        except AttributeError:  # a document that was destroyed has no callbacks any more
            if self.document.session_context is not None:
                raise

    def _arrived(self, text: str, done: Future[str]) -> None:
        self.waiting = None
        if done.cancelled() or self.found is None:
            return
        if text != self.found.text:
            self._confirm(self.found.text)
            return
        self.climbing = None
        if (error := done.exception()) is None:
            self.results.body = done.result()
        else:
            killed = isinstance(error, BrokenExecutor)
            doubt = "its process was killed; move a slider to try again" if killed else str(error)
            ladder = seen_ladder(self.found.design, self.shared.beside)
            self.results.body = with_ladder(self.found.body(doubt), ladder)

    def _reset(self) -> None:
        for key, widget in self.widgets.items():
            widget.value = self.own[key]

    def _save(self) -> None:
        try:
            path = self._save_as(self.name.value or "")
        except SlewctlError as error:
            self.told.object = escape(str(error))
        else:
            name = escape(shlex.quote(str(path)))
            self.told.object = f"Saved: {escape(str(path))}<br>Next: slewctl check {name}"

    def _save_as(self, name: str) -> Path:
        """Write the design as it is set beside its file, over nothing but what was saved here."""
        where = f"save as {name}"
        plain = name.isprintable() and Path(name).name == name and not name.startswith("-")
        if not (plain and name.endswith(".toml") and len(name) <= _LONGEST):
            raise InputError("is no name of a TOML file", where=where, remedy="as in arm-2.toml")
        path = self.shared.design.path.with_name(name)
        if os.path.lexists(path) and read_bytes(path) != self.saved.get(path):
            raise InputError("exists already", where=where, remedy="give another name")
        text = changed_text(self.shared.design, self.settings)
        design_of_text(text, path)
        self.saved[path] = text.encode()
        write_bytes(path, self.saved[path])
        return path


def _widget(knob: Knob) -> Any:
    """Return the slider of a knob, or the choice of a basis."""
    if isinstance(knob.value, str):
        return pn.widgets.Select(
            name=knob.label, options=list(knob.values), value=knob.value, width=_INNER
        )
    options = {knob.text(value): value for value in knob.values}
    return pn.widgets.DiscreteSlider(
        name=knob.label, options=options, value=knob.value, width=_INNER
    )


def _climbed(text: str, path: Path, name: str, own: str) -> str:
    """Return the ladder of a first look at a text; in a process of its own."""
    return seen_ladder(design_of_text(text, path, name), _own(own, path, name))


def _confirmed(text: str, path: Path, name: str, own: str) -> str:
    """Return what the gate says of a text, as a part of the page; in a process of its own."""
    _step_back()
    return explored(design_of_text(text, path, name), beside=_own(own, path, name)).body()


@cache
def _step_back() -> None:
    """Let a first look at what is set now go before."""
    if hasattr(os, "nice"):
        os.nice(_BEHIND)


@cache
def _own(text: str, path: Path, name: str) -> CaseResult | None:
    return before(design_of_text(text, path, name))
