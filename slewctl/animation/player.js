// Plays every animation of the page that does not play yet: pause, scrub, speed.  Until it is
// started there are poses at a few times.
for (const figure of document.querySelectorAll("figure.slew-motion:not([data-ready])")) {
  figure.dataset.ready = "";
  const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
  const [button, range, output, speed] =
    ["button", "input", "output", "select"].map((name) => figure.querySelector(`.bar ${name}`));
  const rows = figure.querySelector(".rows");
  const marks = rows.querySelectorAll(".now");
  const [left, right, across] = data.rows;
  const [cx, cy] = data.origin;
  const line = (points) => "M" + points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L");

  // Of one arm: where the points of its beam are at a place between two pictures.
  const shape = (arm, k, part) => {
    const next = Math.min(k + 1, arm.t.length - 1);
    const between = (values, i, j) => values[i] + part * (values[j] - values[i]);
    const angle = between(arm.theta, k, next), cos = Math.cos(angle), sin = Math.sin(angle);
    const n = arm.x.length;
    return arm.x.map((x, i) => {
      const bent = data.part * between(arm.bent, k * n + i, next * n + i);
      return [cx + x * cos - bent * sin, cy - x * sin - bent * cos];
    });
  };
  const place = (arm, time) => {
    let low = 0, high = arm.t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (arm.t[middle] <= time) low = middle; else high = middle;
    }
    const length = arm.t[high] - arm.t[low];
    const part = length > 0 ? Math.min(Math.max((time - arm.t[low]) / length, 0), 1) : 0;
    return [low, part];
  };
  const arms = data.arms.map((arm, i) => {
    const pane = figure.querySelectorAll(".panes svg")[i];
    const parts = Object.fromEntries(["rigid", "trace", "beam", "tip"]
      .map((name) => [name, pane.querySelector(`.moving .${name}`)]));
    const tips = arm.t.map((_, k) => shape(arm, k, 0).at(-1));
    return { ...arm, parts, tips };
  });

  let time = 0, playing = false, before = 0;
  const draw = () => {
    figure.dataset.moved = "";
    for (const arm of arms) {
      const [k, part] = place(arm, time);
      const beam = shape(arm, k, part), tip = beam.at(-1);
      const next = Math.min(k + 1, arm.t.length - 1);
      const told = arm.ref[k] + part * (arm.ref[next] - arm.ref[k]);
      const rigid = [arm.x[0], arm.x.at(-1)].map((x) => [cx + x * Math.cos(told), cy - x * Math.sin(told)]);
      arm.parts.rigid.setAttribute("d", line(rigid));
      arm.parts.trace.setAttribute("d", line([...arm.tips.slice(0, k + 1), tip]));
      arm.parts.beam.setAttribute("d", line(beam));
      arm.parts.tip.setAttribute("cx", tip[0]);
      arm.parts.tip.setAttribute("cy", tip[1]);
    }
    const x = left + (time / data.end) * (right - left);
    for (const mark of marks) mark.setAttribute("transform", `translate(${x} 0)`);
    range.value = time;
    output.textContent = `${time.toFixed(data.end < 1 ? 4 : 2)} s`;
    range.ariaValueText = output.textContent;
  };
  const say = () => { button.textContent = playing ? "Pause" : time >= data.end ? "Again" : "Play"; };
  const move = (now) => {
    if (!playing || !figure.isConnected) return;
    time = Math.min(time + (Math.max(now - before, 0) / 1000) * speed.value, data.end);
    before = now;
    if (time >= data.end) playing = false;
    draw();
    say();
    if (playing) requestAnimationFrame(move);
  };
  const seek = (value) => { time = Math.min(Math.max(value, 0), data.end); draw(); say(); };
  button.addEventListener("click", () => {
    playing = !playing;
    if (playing && time >= data.end) time = 0;
    before = performance.now();
    say();
    if (playing) requestAnimationFrame(move);
  });
  range.addEventListener("input", () => { playing = false; seek(Number(range.value)); });
  const scrub = (event) => {
    if (!(event.buttons & 1)) return;
    const box = rows.getBoundingClientRect();
    playing = false;
    seek((((event.clientX - box.left) / box.width) * across - left) / (right - left) * data.end);
  };
  rows.addEventListener("pointerdown", scrub);
  rows.addEventListener("pointermove", scrub);
}
