"""The frame of the explorer's page: its controls have names, its results a place."""

from __future__ import annotations

import param
from panel.custom import JSComponent

# In ms: results that come later than this say that they are awaited, as those of a solver.
_PATIENCE = 300
# In ms: how often is looked for sliders without a name.
_EVERY = 500
# The controls follow the screen as the results do; their library has but one theme at a time.
PAGE = """
{% extends base %}
{% block preamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body { margin: 0; font: 1rem/1.5 system-ui, sans-serif; }
@media (prefers-color-scheme: dark) {
  :root { color-scheme: dark; --design-background-color: #15191d; --design-surface-color: #2b3238;
    --design-background-text-color: #e6eaee; --design-surface-text-color: #e6eaee; }
  body { background: #15191d; }
}
</style>
{% endblock %}
{% block contents %}{{ embed(roots.page) }}
<script>
// Sliders have neither a name nor a value in words for those who hear the page: both stand in a
// text above each, which changes with it, and handles are made anew when ends change.
(() => {
  const all = (root, selector) => [
    ...root.querySelectorAll(selector),
    ...[...root.querySelectorAll("*")]
      .flatMap((e) => e.shadowRoot ? all(e.shadowRoot, selector) : []),
  ];
  const tell = (handle) => {
    const texts = all(handle.getRootNode().host.getRootNode(), ".bk-clearfix");
    const [name, ...value] = (texts.find((e) => e.textContent)?.textContent ?? "").split(": ");
    const told = { "aria-label": name, "aria-valuetext": value.join(": ") };
    for (const [key, text] of Object.entries(told)) {
      if (text && handle.getAttribute(key) !== text) handle.setAttribute(key, text);
    }
    return texts;
  };
  const known = new WeakSet();
  setInterval(() => {
    for (const handle of all(document, ".noUi-handle")) {
      if (known.has(handle)) continue;
      known.add(handle);
      const again = new MutationObserver(() => tell(handle));
      again.observe(handle, { attributes: true, attributeFilter: ["aria-valuetext"] });
      // The text itself is replaced by another; what holds it stays.
      const words = { childList: true, characterData: true, subtree: true };
      for (const text of tell(handle)) again.observe(text.getRootNode(), words);
    }
  }, EVERY);
})();
</script>{% endblock %}
""".replace("EVERY", str(_EVERY))
"""What stands around the controls."""


class Results(JSComponent):
    """The page of results in a frame of its own, with what the last settings gave."""

    page = param.String(doc="The empty page.")
    body = param.String(doc="What stands in it now.")
    busy = param.Boolean(doc="Whether other settings are being looked at.")

    _esm = (
        f"const PATIENCE = {_PATIENCE};"
        + """
export function render({ model }) {
  const frame = document.createElement("iframe");
  Object.assign(frame, { title: "Results", srcdoc: model.page });
  frame.style = "border: 0; width: 100%; height: 100%; min-height: 40rem";
  let kept, late;
  const main = () => frame.contentDocument?.querySelector("main");
  // What stands there is of other settings: it is told where that lasts.
  const wait = () => {
    clearTimeout(late);
    if (model.busy) late = setTimeout(() => main()?.setAttribute("aria-busy", "true"), PATIENCE);
    else main()?.removeAttribute("aria-busy");
  };
  const put = () => {
    const now = frame.contentDocument.querySelector("[data-names]")?.kept?.();
    if (now) kept = { off: now.off, zooms: { ...kept?.zooms, ...now.zooms } };
    main().innerHTML = model.body;
    const { CustomEvent } = frame.contentWindow;
    frame.contentWindow.dispatchEvent(new CustomEvent("plots", { detail: kept }));
  };
  frame.addEventListener("load", put);
  model.on("body", put);
  model.on("busy", wait);
  return frame;
}
"""
    )
