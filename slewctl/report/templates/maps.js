// The maps of a study: a cell tells its case under the pointer or the arrow keys, and opens it.
(() => {
  "use strict";
  const dialog = document.querySelector("dialog.case");
  const readout = document.body.appendChild(Object.assign(document.createElement("div"), { className: "readout", hidden: true, role: "status" }));
  const text = (value, unit = "") => value === null || value === undefined ? "–" : `${value === "inf" ? "∞" : String(value).replaceAll("-", "−")} ${unit}`.trim();
  for (const figure of document.querySelectorAll("figure.map")) {
    const svg = figure.querySelector("svg"), places = JSON.parse(svg.dataset.places);
    const data = JSON.parse(figure.querySelector("script").textContent), { bases, orders, hubs, told, cells } = data;
    const frame = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    frame.setAttribute("class", "here");
    let now = null;
    const words = ({ basis, n, hub }) => {
      const found = cells[basis][n][hub], title = `${bases[basis]}, n = ${orders[n]}, hub inertia ${hubs[hub]} of the beam's`;
      if (found === null) return [title, "not in this study"];
      if (typeof found === "string") return [title, `no design: ${found}`];
      const [loss, gain, phase, disk] = found;
      if (loss === null) return [title, `unstable: mode ${text(found[7])} grows`];
      return [title, `${text(+(100 * loss).toPrecision(3))} % lost ${data.yardstick}; gain margin ${text(gain, "dB")}, phase margin ${text(phase, "deg")}, disk margin ${text(disk)}`];
    };
    const show = (cell) => {
      now = cell;
      const [left, top, size] = places[cell.basis];
      for (const [key, value] of Object.entries({ x: left + cell.hub * size - 1, y: top + (orders.length - 1 - cell.n) * size - 1, width: size, height: size })) frame.setAttribute(key, value);
      svg.append(frame);
      const [title, line] = words(cell);
      readout.replaceChildren(Object.assign(document.createElement("b"), { textContent: title }), line);
      readout.hidden = false;
    };
    const open = (cell) => {
      const [title, line] = words(cell), found = cells[cell.basis][cell.n][cell.hub];
      const add = (name, content, parent = dialog) => parent.appendChild(Object.assign(document.createElement(name), { textContent: content }));
      dialog.replaceChildren();
      add("h3", title);
      add("p", `${line}. ${data.title}.`);
      if (Array.isArray(found)) {
        const table = dialog.appendChild(document.createElement("table"));
        found.slice(1).forEach((value, k) => {
          if (value === null) return;
          const row = table.insertRow();
          add("td", told[k][0], row);
          add("td", text(value, told[k][1]), row);
        });
      }
      const close = add("button", "Close");
      close.addEventListener("click", () => dialog.close());
      dialog.showModal();
    };
    const clear = () => { readout.hidden = true; frame.remove(); };
    const under = (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      for (const [basis, [left, top, size]] of places.entries()) {
        const hub = Math.floor((at.x - left) / size), row = Math.floor((at.y - top) / size);
        if (hub >= 0 && hub < hubs.length && row >= 0 && row < orders.length) return { basis, n: orders.length - 1 - row, hub };
      }
      return null;
    };
    svg.addEventListener("pointermove", (event) => { const cell = under(event); if (cell) show(cell); else clear(); });
    svg.addEventListener("pointerleave", clear);
    svg.addEventListener("click", (event) => { const cell = under(event); if (cell) { show(cell); open(cell); } });
    figure.tabIndex = 0;
    figure.addEventListener("blur", clear);
    figure.addEventListener("keydown", (event) => {
      const moves = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      if (event.key === "Enter" && now && event.target === figure) {
        event.preventDefault();  // or the same key would press the button that closes it
        return void open(now);
      }
      if (!(event.key in moves) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      if (!now) return void show({ basis: 0, n: 0, hub: 0 });
      // Beyond the edge of one basis is the next.
      const [right, up] = moves[event.key], across = now.basis * hubs.length + now.hub + right;
      if (across < 0 || across >= bases.length * hubs.length) return;
      show({ basis: Math.floor(across / hubs.length), hub: across % hubs.length, n: Math.min(Math.max(now.n + up, 0), orders.length - 1) });
    });
  }
})();
