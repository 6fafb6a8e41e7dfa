// The plots of a page under the pointer: the curves are read from the paths that are drawn, and
// drawn again when a part is enlarged.  Without this script all of them stand as they are.
(() => {
  "use strict";
  const FINE = 100, NS = "http://www.w3.org/2000/svg";
  const make = (parent, name, attributes) => {
    const element = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return parent.appendChild(element);
  };
  const shown = (value, digits = 4) => !Number.isFinite(value) ? "–" : String(+value.toPrecision(digits)).replaceAll("-", "−");

  // Axes: `range` is what is shown, in what the axis is linear in.
  const bent = (axis, v) => axis.kind === "log" ? Math.log10(v)
    : axis.kind === "symlog" && Math.abs(v) > axis.bend ? Math.sign(v) * (1 + Math.log10(Math.abs(v) / axis.bend))
    : axis.kind === "symlog" ? v / axis.bend : v;
  const unbent = (axis, u) => axis.kind === "log" ? 10 ** u
    : axis.kind === "symlog" ? axis.bend * (Math.abs(u) > 1 ? Math.sign(u) * 10 ** (Math.abs(u) - 1) : u) : u;
  const readAxis = (text, label) => {
    const [kind, ...numbers] = text.split(" ");
    const [low, high, bend, step] = numbers.map(Number), axis = { kind, bend, step, label };
    axis.home = [bent(axis, low), bent(axis, high)];
    axis.range = [...axis.home];
    return axis;
  };
  const level = (low, high, multiple) => {
    const rough = (high - low) / 6, power = 10 ** Math.floor(Math.log10(rough));
    const usual = power * [1, 2, 5, 10].find((s) => s * power >= rough * (1 - 1e-9));
    const step = multiple && rough > multiple / 8 ? multiple * 2 ** Math.max(Math.ceil(Math.log2(rough / multiple)), -3) : usual;
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  };
  const marks = (axis) => {
    const [a, b] = axis.range, low = unbent(axis, a), high = unbent(axis, b);
    if (axis.kind === "linear" || (axis.kind === "log" && b - a < 0.6)) return level(low, high, axis.step);
    const decades = (from, to) => {
      const found = [], first = Math.floor(Math.log10(from)), last = Math.ceil(Math.log10(to)), few = Math.log10(to / from) < 2.2;
      const every = Math.ceil((last - first) / 12);
      for (let k = first; k <= last; k++) if (few || k % every === 0) for (const m of few ? [1, 2, 5] : [1]) found.push(m * 10 ** k);
      return found;
    };
    const far = axis.kind === "log" ? decades(low, high) : decades(axis.bend, Math.max(Math.abs(low), Math.abs(high), axis.bend));
    const all = axis.kind === "log" ? far : [...far.map((v) => -v), 0, ...far];
    return all.filter((v) => bent(axis, v) >= a - 1e-9 && bent(axis, v) <= b + 1e-9);
  };

  // A path's runs of points in parts of a unit; of marks, the points where they stand.
  const runs = (path) => [...path.matchAll(/M(-?\d+) (-?\d+)(?:l([-\d ]*?))?(?=[Mhm]|$)/g)].map((found) => {
    const points = [[+found[1], +found[2]]], steps = (found[3] || "").match(/-?\d+/g) || [];
    for (let k = 0; k + 1 < steps.length; k += 2) {
      const [x, y] = points[points.length - 1];
      points.push([x + +steps[k], y + +steps[k + 1]]);
    }
    return points;
  });
  const GLYPH = /(?<=M-?\d+ -?\d+)(h0|m-400.*?)(?=M|$)/;
  // A smooth curve through points: cubics whose slopes are those of the parabolas through three.
  const spline = (u, v) => {
    const n = u.length, chord = (k) => (v[k + 1] - v[k]) / (u[k + 1] - u[k]);
    const m = v.map((_, k) => n < 2 ? 0 : k === 0 ? chord(0) : k === n - 1 ? chord(n - 2)
      : (chord(k - 1) * (u[k + 1] - u[k]) + chord(k) * (u[k] - u[k - 1])) / (u[k + 1] - u[k - 1]));
    return (at, straight = false) => {
      if (at < u[0] || at > u[n - 1]) return NaN;
      let a = 0, b = n - 1;
      while (b - a > 1) { const c = (a + b) >> 1; if (u[c] <= at) a = c; else b = c; }
      const h = u[b] - u[a], t = h ? (at - u[a]) / h : 0, s = 1 - t;
      if (straight) return s * v[a] + t * v[b];
      return v[a] * s * s * (1 + 2 * t) + v[b] * t * t * (3 - 2 * t) + h * (m[a] * t * s * s - m[b] * t * t * s);
    };
  };

  const readPanel = (g) => {
    const [left, top, width, height] = g.dataset.box.split(" ").map(Number), { link, role } = g.dataset;
    const panel = { g, left, top, width, height, link, role, marked: "xMarked" in g.dataset,
      x: readAxis(g.dataset.x, g.dataset.xLabel), y: readAxis(g.dataset.y, g.dataset.yLabel),
      inner: g.querySelector("svg"), grid: g.querySelector(".marks") };
    panel.still = panel.grid.innerHTML;
    panel.paths = [...panel.inner.querySelectorAll("path")].map((element) => {
      const d = element.getAttribute("d"), own = /\bo(\d+)/.exec(element.getAttribute("class"));
      return { element, d, design: own ? +own[1] : null, runs: runs(d), glyph: GLYPH.exec(d)?.[0] };
    });
    panel.words = [...panel.inner.querySelectorAll("text")].map((element) => ({ element, x: +element.getAttribute("x"), y: +element.getAttribute("y") }));
    // What is written at the top stays there.
    panel.values = (points) => points.map(([x, y]) => [home(panel.x, x / FINE / width), home(panel.y, 1 - y / FINE / height)]);
    panel.curves = new Map();
    for (const path of panel.paths) {
      if (path.design === null || path.glyph || panel.curves.has(path.design)) continue;
      const points = panel.values(path.runs.flat()).filter((p, k, all) => k === 0 || p[0] > all[k - 1][0]);
      panel.curves.set(path.design, { u: points.map((p) => p[0]), at: spline(points.map((p) => p[0]), points.map((p) => p[1])) });
    }
    return panel;
  };
  const home = (axis, part) => axis.home[0] + part * (axis.home[1] - axis.home[0]);
  const place = (panel, u, v) => [(u - panel.x.range[0]) / (panel.x.range[1] - panel.x.range[0]) * panel.width,
    (1 - (v - panel.y.range[0]) / (panel.y.range[1] - panel.y.range[0])) * panel.height];
  const enlarged = (panel) => [panel.x, panel.y].some((axis) => axis.range.some((end, k) => end !== axis.home[k]));

  // What a loop shows at a frequency, from its gain and phase, by the role of a panel.
  const LOOP = {
    gain: (l) => [l.u, l.gain], phase: (l) => [l.u, l.phase],
    nichols: (l) => [l.phase - 360 * Math.ceil(l.phase / 360), l.gain],
    nyquist: (l) => [l.re, l.im],
    sensitivity: (l) => [l.u, -10 * Math.log10((1 + l.re) ** 2 + l.im ** 2)],
    complementary: (l) => [l.u, l.gain - 10 * Math.log10((1 + l.re) ** 2 + l.im ** 2)],
  };
  const loopAt = (part, design, u) => {
    const gain = part.role.gain.curves.get(design).at(u), phase = part.role.phase.curves.get(design).at(u);
    const size = 10 ** (gain / 20), turn = phase * Math.PI / 180;
    return { u, gain, phase, re: size * Math.cos(turn), im: size * Math.sin(turn) };
  };

  const start = (section, kept) => {
    const plots = [...section.querySelectorAll("figure[data-kind]")].map((figure) => ({ figure, svg: figure.querySelector("svg"), panels: [...figure.querySelectorAll(".panel")].map(readPanel) }));
    const panels = plots.flatMap((plot) => plot.panels), names = JSON.parse(section.dataset.names), modes = JSON.parse(section.dataset.modes);
    const part = { plots, panels, names, role: Object.fromEntries(panels.map((p) => [p.role, p])), cursor: null };
    const visible = () => names.map((_, k) => k).filter((k) => !section.classList.contains(`off${k}`));
    const readout = document.body.appendChild(Object.assign(document.createElement("div"), { className: "readout", hidden: true, role: "status" }));

    const draw = (panel) => {
      const wide = enlarged(panel), ends = [panel.x, panel.y].map((axis) => (axis.home[1] - axis.home[0]) / (axis.range[1] - axis.range[0]));
      const [left, ground] = place(panel, panel.x.home[0], panel.y.home[0]), top = ground - panel.height * ends[1];
      const moved = ([x, y]) => [x * ends[0] + left * FINE, y * ends[1] + top * FINE];
      for (const path of panel.paths) {
        const smooth = path.design !== null && !path.glyph && (panel.role in LOOP || panel.role === "tip" || panel.role === "error");
        const text = (points) => "M" + points.map(([x, y]) => `${x.toFixed(0)} ${y.toFixed(0)}`).join("L");
        if (!wide) path.element.setAttribute("d", path.d);
        else if (smooth) path.element.setAttribute("d", dense(panel, path.design).map(text).join(""));
        else path.element.setAttribute("d", path.runs.map((run) => text(run.map(moved)) + (path.glyph || "")).join(""));
      }
      for (const word of panel.words) {
        word.element.setAttribute("x", word.x * ends[0] + left);
        word.element.setAttribute("y", word.element.classList.contains("n") ? word.y : word.y * ends[1] + top);
      }
      panel.grid.innerHTML = panel.still;
      if (!wide) return;
      panel.grid.textContent = "";
      const lines = make(panel.grid, "path", { class: "g" }), right = panel.left + panel.width, bottom = panel.top + panel.height;
      let d = "";
      for (const v of marks(panel.x)) {
        const at = panel.left + place(panel, bent(panel.x, v), 0)[0];
        d += `M${at} ${panel.top}V${bottom}`;
        if (panel.marked) make(panel.grid, "text", { class: "m", x: at, y: bottom + 13 }).textContent = shown(v, 6);
      }
      for (const v of marks(panel.y)) {
        const at = panel.top + place(panel, 0, bent(panel.y, v))[1];
        d += `M${panel.left} ${at}H${right}`;
        make(panel.grid, "text", { class: "e", x: panel.left - 5, y: at + 4 }).textContent = shown(v, 6);
      }
      lines.setAttribute("d", d);
    };
    // A curve in as many points as an enlarged part needs, broken where it leaves it.
    const dense = (panel, design) => {
      const own = panel.role in LOOP ? part.role.gain.curves.get(design) : panel.curves.get(design), found = [];
      let run = null, last = null;
      for (let k = 0; k + 1 < own.u.length; k++) for (let i = 0; i < 8; i++) {
        const u = own.u[k] + (own.u[k + 1] - own.u[k]) * i / 8;
        const [a, b] = panel.role in LOOP ? LOOP[panel.role](loopAt(part, design, u)) : [u, own.at(u)], [x, y] = place(panel, a, b);
        const inside = x > -panel.width && x < 2 * panel.width && y > -panel.height && y < 2 * panel.height;
        if (!inside || (last !== null && panel.role === "nichols" && Math.abs(a - last) > 180)) run = null;
        if (inside && !run) found.push(run = []);
        if (inside) run.push([x * FINE, y * FINE]);
        last = a;
      }
      return found.length ? found : [[[0, -FINE]]];
    };
    const zoom = (panel, x, y) => {
      const keep = (axis, [a, b]) => { if (b - a > 1e-4 * (axis.home[1] - axis.home[0])) axis.range = [Math.max(a, axis.home[0]), Math.min(b, axis.home[1])]; };
      if (x) for (const other of panel.link ? panels.filter((p) => p.link === panel.link) : [panel]) keep(other.x, x);
      if (y) keep(panel.y, y);
      redraw();
    };
    const redraw = () => { panels.forEach(draw); if (part.cursor) part.cursor(); };
    const scale = (plot, factor) => {
      // Around what is pointed at, or the critical point, or the middle.
      const [panel] = plot.panels, critical = { nichols: [-180, 0], nyquist: [-1, 0] }[panel.role], both = !panel.link;
      const inside = (at) => at && [panel.x, panel.y].every(({ range }, k) => at[k] > range[0] && at[k] < range[1] || (!both && k));
      const at = [panel.at, critical].find(inside) ?? [panel.x, panel.y].map(({ range }) => (range[0] + range[1]) / 2);
      const [x, y] = [panel.x, panel.y].map(({ range }, k) => range.map((end) => at[k] + (end - at[k]) * factor));
      zoom(panel, x, both && y);
    };
    const reset = (plot) => {
      for (const panel of plot.panels) for (const other of panel.link ? panels.filter((p) => p.link === panel.link) : [panel]) {
        other.x.range = [...other.x.home];
        if (other === panel) other.y.range = [...other.y.home];
      }
      redraw();
    };

    const clear = () => { for (const panel of panels) { panel.inner.querySelectorAll(".cursor, .hair").forEach((e) => e.remove()); panel.at = null; } readout.hidden = true; part.cursor = null; };
    const tell = (title, lines) => {
      readout.textContent = "";
      readout.append(Object.assign(document.createElement("b"), { textContent: title }));
      for (const line of lines) readout.append(Object.assign(document.createElement("div"), { textContent: line }));
      readout.hidden = false;
    };
    const dot = (panel, design, u, v) => {
      const [x, y] = place(panel, u, v);
      if (Number.isFinite(x) && Number.isFinite(y)) make(panel.inner, "circle", { class: `cursor o${design}`, cx: x, cy: y, r: 4.5 });
      panel.at ??= [u, v];
    };
    const hair = (panel, u) => { const [x] = place(panel, u, 0); make(panel.inner, "path", { class: "hair", d: `M${x} 0V${panel.height}` }); };
    // The same frequency, time, number of modes or place in every panel that shows it.
    const along = (link, u) => {
      clear();
      part.cursor = () => along(link, u);
      const own = panels.filter((p) => p.link === link || (link === "frequency" && p.role in LOOP)), axis = own[0].x;
      for (const panel of own) if (panel.link) hair(panel, u);
      const lines = visible().map((design) => {
        const loop = link === "frequency" ? loopAt(part, design, u) : null;
        const values = own.map((panel) => {
          if (!loop && !panel.curves.has(design)) return "";
          const [a, b] = loop ? LOOP[panel.role](loop) : [u, panel.curves.get(design).at(u, true)];
          dot(panel, design, a, b);
          return panel.link && Number.isFinite(b) ? panel.y.label.replace(/ \((.*)\)|$/, (_, unit) => ` ${shown(unbent(panel.y, b))} ${unit || ""}`).trim() : "";
        });
        return `${names[design]}:  ${values.filter(Boolean).join(",  ") || "no value"}`;
      });
      const value = unbent(axis, u), near = link === "frequency" ? modes.findIndex((hz) => Math.abs(hz / value - 1) < 0.04) : -1;
      const [, name, unit] = /^(.*?)(?: \((.*)\))?$/.exec(axis.label);
      tell(`${name} ${shown(value)} ${unit || ""}${near >= 0 ? `, mode ${near + 1} (${shown(modes[near])} Hz)` : ""}`, lines);
    };
    const atPole = (panel, { design, u, v }) => {
      clear();
      part.cursor = () => atPole(panel, { design, u, v });
      dot(panel, design, u, v);
      const hertz = unbent(panel.x, u), decay = unbent(panel.y, v);
      tell(names[design], [`pole at ${shown(hertz)} Hz, decay rate ${shown(decay)} 1/s, damping ratio ${shown(decay / (2 * Math.PI * hertz))}`]);
    };
    const poles = (panel) => panel.paths.filter((p) => p.glyph === "h0" && visible().includes(p.design))
      .flatMap((p) => panel.values(p.runs.flat()).map(([u, v]) => ({ design: p.design, u, v }))).sort((a, b) => a.u - b.u);
    // Points of a loop for a search by distance in a Nichols or Nyquist plot.
    const points = (panel) => visible().flatMap((design) => part.role.gain.curves.get(design).u.map((u) => [u, ...LOOP[panel.role](loopAt(part, design, u))]));
    const nearest = (panel, list, x, y) => {
      let best = null, least = Infinity;
      for (const item of list) {
        const [a, b] = place(panel, item.u ?? item[1], item.v ?? item[2]), off = Math.hypot(a - x, b - y);
        if (off < least) [best, least] = [item, off];
      }
      return best;
    };
    const point = (panel, x, y) => {
      if (panel.role === "poles") { const pole = nearest(panel, poles(panel), x, y); if (pole) atPole(panel, pole); }
      else if (panel.link) {
        let u = panel.x.range[0] + x / panel.width * (panel.x.range[1] - panel.x.range[0]);
        if (panel.link === "modes") u = Math.round(u);
        along(panel.link, Math.min(Math.max(u, panel.x.home[0]), panel.x.home[1]));
      } else if (panel.role in LOOP) { const found = nearest(panel, points(panel), x, y); if (found) along("frequency", found[0]); }
    };
    const step = (plot, way) => {
      const [panel] = plot.panels, frequency = panel.role in LOOP, now = (frequency ? part.role.gain : panel).at?.[0];
      if (panel.role === "poles") {
        const all = poles(panel), next = way > 0 ? all.find((p) => p.u > (now ?? -Infinity)) : all.findLast((p) => p.u < (now ?? Infinity));
        if (next) atPole(panel, next);
        return;
      }
      const first = visible().find((k) => (frequency ? part.role.gain : panel).curves.has(k));
      if (first === undefined) return;
      const curve = (frequency ? part.role.gain : panel).curves.get(first), all = curve.u;
      // The first step goes to where |L| is one, or to the middle.
      const begin = frequency ? all.reduce((best, u) => Math.abs(curve.at(u)) < Math.abs(curve.at(best)) ? u : best) : all[all.length >> 1];
      const next = now === undefined ? begin : way > 0 ? all.find((u) => u > now + 1e-12) : all.findLast((u) => u < now - 1e-12);
      if (next !== undefined) along(frequency ? "frequency" : panel.link, next);
    };

    for (const plot of plots) {
      const { figure, svg } = plot, tools = figure.insertBefore(document.createElement("div"), svg);
      tools.className = "tools";
      for (const [text, label, act] of [["+", "Enlarge", () => scale(plot, 0.5)], ["−", "Reduce", () => scale(plot, 2)], ["⟲", "Show all", () => reset(plot)]]) {
        const button = tools.appendChild(Object.assign(document.createElement("button"), { type: "button", textContent: text, title: label, ariaLabel: `${label}: ${svg.getAttribute("aria-label")}` }));
        button.addEventListener("click", act);
      }
      figure.tabIndex = 0;
      let from = null, rubber = null;
      const where = (event, held) => {
        const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
        const panel = held || plot.panels.find((p) => at.x >= p.left && at.x <= p.left + p.width && at.y >= p.top && at.y <= p.top + p.height);
        return panel && { panel, x: at.x - panel.left, y: at.y - panel.top };
      };
      svg.addEventListener("pointermove", (event) => {
        const here = where(event, from?.panel);
        if (from && here) {
          const x = Math.min(from.x, here.x), y = Math.min(from.y, here.y), w = Math.abs(from.x - here.x), h = Math.abs(from.y - here.y);
          rubber ??= make(from.panel.inner, "rect", { class: "rubber" });
          for (const [key, value] of Object.entries({ x, y: h < 12 ? 0 : y, width: w, height: h < 12 ? from.panel.height : h })) rubber.setAttribute(key, value);
        } else if (here) point(here.panel, here.x, here.y);
      });
      svg.addEventListener("pointerdown", (event) => {
        if (event.button || event.pointerType === "touch") return;
        from = where(event) || null;
        if (from) svg.setPointerCapture(event.pointerId);
      });
      svg.addEventListener("pointerup", (event) => {
        const here = from && where(event, from.panel), { panel } = from || {};
        rubber?.remove();
        if (here && Math.abs(here.x - from.x) > 6) {
          const part = (axis, a, b, size) => [a, b].map((c) => axis.range[0] + c / size * (axis.range[1] - axis.range[0])).sort((p, q) => p - q);
          const tall = Math.abs(here.y - from.y) >= 12;
          zoom(panel, part(panel.x, from.x, here.x, panel.width), tall && part(panel.y, panel.height - from.y, panel.height - here.y, panel.height));
        }
        from = rubber = null;
      });
      svg.addEventListener("click", (event) => { const here = where(event); if (here) point(here.panel, here.x, here.y); });
      svg.addEventListener("dblclick", () => reset(plot));
      figure.addEventListener("pointerleave", () => { if (!figure.contains(document.activeElement)) clear(); });
      figure.addEventListener("focusout", clear);
      figure.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const act = { ArrowRight: () => step(plot, 1), ArrowLeft: () => step(plot, -1), "+": () => scale(plot, 0.5), "=": () => scale(plot, 0.5), "-": () => scale(plot, 2), 0: () => reset(plot), Escape: () => { reset(plot); clear(); } }[event.key];
        if (act) { event.preventDefault(); act(); }
      });
    }
    section.querySelectorAll(".legend li").forEach((item, k) => {
      const label = document.createElement("label"), box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
      label.append(box, ...item.childNodes);
      item.append(label);
      box.addEventListener("change", () => { section.classList.toggle(`off${k}`, !box.checked); redraw(); });
      if (kept?.off[k]) box.click();
    });
    // What is enlarged or hidden now, for plots that are put in the place of these.
    const whole = ({ range, home }) => range.every((end, k) => end === home[k]);
    section.kept = () => ({
      off: names.map((_, k) => section.classList.contains(`off${k}`)),
      zooms: Object.fromEntries(panels.map((p) => [p.role + p.link, [p.x, p.y].map((axis) => whole(axis) ? null : axis.range.map((u) => unbent(axis, u)))])),
    });
    for (const panel of kept ? panels : []) {
      const [x, y] = (kept.zooms[panel.role + panel.link] ?? [null, null]).map((ends, k) => ends?.map((v) => bent([panel.x, panel.y][k], v)));
      if (x || y) zoom(panel, x, y);
    }
  };
  // Read when it is first opened: a page holds many designs.
  const read = (kept) => {
    for (const section of document.querySelectorAll("[data-names]")) {
      const fold = section.closest("details");
      const once = () => { if (!section.dataset.started) { section.dataset.started = "yes"; start(section, kept); } };
      if (!fold || fold.open) once();
      else fold.addEventListener("toggle", once, { once: true });
    }
  };
  read();
  // A page that puts other plots in their place says so, with what was kept of the former ones.
  addEventListener("plots", (event) => {
    document.querySelectorAll(".readout").forEach((old) => old.remove());
    read(event.detail);
  });
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let fold = target?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    target?.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  if (location.hash) reveal();
})();
