"use strict";
// Curves over time: one panel by quantity, with contact intervals, pinned designs and threads of roll-outs.
(function (E) {
  const D = E.design, make = E.make;
  const FIRST = 6, MOST = 16;
  const ROLES = {
    plan: ["plan", "@1", 2, []], truth: ["one run", "@2", 1, []], estimate: ["its estimate", "@3", 1, [4, 3]],
    low: ["−2σ", "@1/0.35", 0.5, []], high: ["+2σ", "@1/0.35", 0.5, []], measured: ["measured", "@1", 2, []],
    used: ["used", "@2", 1.5, [6, 3]], beyond: ["beyond the others", "@1", 2, []], alone: ["alone", "@1", 1, [3, 3]],
    belief: ["of estimation error", "@2", 1, []], target: ["target", "@3", 1, [8, 5]], limit: ["limit", "@4", 1, [8, 5]],
  };
  const PINS = { A: "@4", B: "@5", C: "@6" };
  // What belongs to a run in closed loop: where it leaves the range of all else by so many times its size, it is clipped.
  const RUN = new Set(["truth", "estimate", "low", "high"]);
  const CLIPPED = 5;
  let panels = [];
  let threads = null;

  /** Numbers in single precision, in base64; gaps where they are not finite. */
  function unpack(text) {
    const raw = atob(text);
    const bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
    return Array.from(new Float32Array(bytes.buffer), (value) => (Number.isFinite(value) ? value : null));
  }

  const colour = (name) => () => SuppleTheme.colour(name);

  /** The quantities to begin with: forces and clearances of contacts, then some of each kind. */
  function first(list) {
    const rank = { Contacts: 0, Quantities: 0.5, Information: 1, States: 2, Controls: 3, Cost: 4 };
    const seen = {};
    const chosen = list.filter(({ group }) => {
      seen[group] = (seen[group] || 0) + 1;
      return rank[group] !== undefined && seen[group] <= (group === "Contacts" || group === "States" ? 2 : 1);
    });
    return chosen.sort((a, b) => rank[a.group] - rank[b.group]).slice(0, FIRST).map(({ key }) => key);
  }

  /** The range of an axis where a run diverges, so that all else can still be read; null where none does. */
  function clip(series) {
    const ends = (list) => {
      let least = Infinity, most = -Infinity;
      for (const { y } of list) {
        for (const value of y) {
          if (value === null) continue;
          if (value < least) least = value;
          if (value > most) most = value;
        }
      }
      return [least, most];
    };
    const [least, most] = ends(series.filter(({ role }) => !RUN.has(role)));
    const [lowest, highest] = ends(series.filter(({ role }) => RUN.has(role)));
    const size = Math.max(most - least, Math.abs(most), Math.abs(least)), above = highest - most, below = least - lowest;
    if (!(size > 0) || !Number.isFinite(size) || !(Math.max(above, below) > CLIPPED * size)) return null;
    return { range: [least - size, most + size], worst: above > below ? highest : lowest };
  }

  /** Height of a panel's plot and size of its texts: texts grow with those of the page. */
  const height = (width) => Math.round(Math.max(190 * E.larger(), Math.min(320 * E.larger(), 0.42 * width)));
  const FONT = () => `${Math.round(11 * E.larger())}px system-ui, sans-serif`;

  /** The number of a curve under the pointer; without one, the last number of the curve. */
  function shown(u, value, index, at) {
    if (at !== null && at !== undefined) return value;
    const list = u.data[index] ?? [];
    for (let n = list.length - 1; n >= 0; n -= 1) if (list[n] !== null && list[n] !== undefined) return list[n];
    return null;
  }

  class Panel {
    constructor(key) {
      this.quantity = D.tasks[D.task].quantities.find((one) => one.key === key);
      const { name, unit } = this.quantity;
      this.place = make("div", { class: "plot", role: "img", "aria-label": name });
      const close = make("button", { type: "button", class: "close", "aria-label": `Remove ${name}`, onclick: () => remove(this) }, "×");
      this.element = make("figure", { class: "panel", "data-key": key },
        make("figcaption", {}, make("span", {}, name, unit ? make("span", { class: "unit" }, ` ${unit}`) : null, this.note = make("span", { class: "unit" })), close), this.place);
      this.shape = "";
    }

    /** The curves of the design on screen and of pins, as one table with common times. */
    tables() {
      const of = (curves, prefix, pin) => {
        const found = curves?.curves.find((one) => one.key === this.quantity.key);
        if (!found) return null;
        // Of pins only the plan.
        const series = pin ? found.series.slice(0, 5).filter(({ role }) => !["low", "high", "truth", "estimate"].includes(role)).slice(0, 1) : found.series;
        return { x: unpack(found.x), series: series.map(({ role, y }) => ({ role, pin, label: `${prefix}${ROLES[role][0]}`, y: unpack(y) })) };
      };
      const list = [of(E.now?.curves, "", null)];
      D.pins.forEach((pin) => list.push(of(pin.answer?.curves, `${pin.name}: `, pin.name)));
      return list.filter((one) => one && one.x.length);
    }

    draw() {
      const tables = this.tables();
      if (!tables.length) return;
      const series = tables.flatMap((table) => table.series);
      this.clip = clip(series);
      const { unit } = this.quantity;
      this.note.textContent = this.clip ? ` (clipped: a run reaches ${E.number(this.clip.worst)}${unit ? ` ${unit}` : ""})` : "";
      const same = tables.every(({ x }) => x.length === tables[0].x.length && x[x.length - 1] === tables[0].x[tables[0].x.length - 1]);
      // Runs that diverge end early.
      const filled = (y, count) => (y.length < count ? [...y, ...Array(count - y.length).fill(null)] : y.slice(0, count));
      const rows = (table) => [table.x, ...table.series.map(({ y }) => filled(y, table.x.length))];
      const data = same ? [tables[0].x, ...tables.flatMap((table) => rows(table).slice(1))] : uPlot.join(tables.map(rows));
      const shape = series.map(({ label }) => label).join();
      if (this.plot && shape === this.shape) {
        this.plot.setData(data);
      } else {
        this.shape = shape;
        this.plot?.destroy();
        this.plot = new uPlot(this.options(series), data, this.place);
      }
      // Around a single time, as of a task of one step.
      const [time, ...others] = data[0], half = 0.5 * (Math.abs(time) || 1);
      if (!others.length) this.plot.setScale("x", { min: time - half, max: time + half });
    }

    options(series) {
      const { unit } = this.quantity;
      const axis = { stroke: colour("@ink"), grid: { stroke: colour("@faint"), width: 1 }, ticks: { stroke: colour("@faint"), width: 1 }, font: FONT() };
      const index = (role) => series.findIndex((one) => one.role === role && !one.pin) + 1;
      const bands = index("high") ? [{ series: [index("high"), index("low")], fill: colour("@1/0.14") }] : [];
      return {
        width: this.width(), height: height(this.width()), bands, cursor: { sync: { key: "time" }, points: { size: 5 } },
        scales: {
          x: { time: false },
          y: { range: (_, least, most) => this.clip?.range ?? (least === null ? [0, 1] : uPlot.rangeNum(least, most, 0.1, true)) },
        },
        legend: { live: true },
        axes: [{ ...axis, size: 30 * E.larger(), values: (_, ticks) => E.distinct(ticks).map((text) => (text ? `${text} s` : "")) },
          { ...axis, size: 58 * E.larger(), values: (_, ticks) => E.distinct(ticks) }],
        series: [{ label: "time", value: (...at) => `${E.number(shown(...at))} s` },
          ...series.map(({ role, label, pin, y }) => {
            const [, tint, width, dash] = ROLES[role];
            return {
              label, stroke: colour(pin ? PINS[pin] : tint), width: pin ? 2 : width, dash: pin ? [8, 3] : dash, spanGaps: !pin ? false : true, points: { show: y.length < 2 },
              value: (...at) => {
                const value = shown(...at);
                return `${E.number(value)}${unit && Number.isFinite(value) ? ` ${unit}` : ""}`;
              },
            };
          })],
        hooks: { drawClear: [shade, (u) => this.threads(u)] },
      };
    }

    width() {
      return Math.max(220, this.element.clientWidth - 2);
    }

    /** Roll-outs of the design on screen as thin lines. */
    threads(u) {
      const found = threads?.curves.get(this.quantity.key);
      if (!found) return;
      const { ctx } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
      ctx.clip();
      ctx.strokeStyle = SuppleTheme.colour("@7/0.4");
      ctx.lineWidth = 1;
      for (const y of found.list) {
        ctx.beginPath();
        let on = false;
        y.forEach((value, n) => {
          if (value === null) { on = false; return; }
          const px = u.valToPos(found.x[n], "x", true), py = u.valToPos(value, "y", true);
          if (on) ctx.lineTo(px, py);
          else ctx.moveTo(px, py);
          on = true;
        });
        ctx.stroke();
      }
      ctx.restore();
    }
  }

  /** Times at which contacts touch are shaded. */
  function shade(u) {
    const touching = E.now?.curves?.touching;
    if (!touching) return;
    u.ctx.save();
    touching.forEach(({ intervals }, n) => {
      u.ctx.fillStyle = SuppleTheme.colour(["@5/0.16", "@3/0.16", "@4/0.16"][n % 3]);
      for (const [from, until] of intervals) {
        const left = Math.max(u.bbox.left, u.valToPos(from, "x", true));
        const right = Math.min(u.bbox.left + u.bbox.width, u.valToPos(until, "x", true));
        if (right > left) u.ctx.fillRect(left, u.bbox.top, right - left, u.bbox.height);
      }
    });
    u.ctx.restore();
  }

  function keys() {
    const touching = E.now?.curves?.touching?.filter(({ intervals }) => intervals.length) ?? [];
    const text = touching.length ? `Shaded: ${touching.map(({ name }) => name).join(", ")} touch${touching.length > 1 ? "" : "es"}.` : "";
    document.getElementById("curve-keys").textContent = text;
  }

  function remove(panel) {
    panel.plot?.destroy();
    panels = panels.filter((one) => one !== panel);
    panel.element.remove();
    choices();
  }

  function add(key) {
    if (panels.length >= MOST || panels.some((panel) => panel.quantity.key === key)) return;
    const panel = new Panel(key);
    panels.push(panel);
    document.getElementById("panels").append(panel.element);
    watch.observe(panel.element);
    choices();
  }

  const watch = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      const panel = panels.find((one) => one.element === target);
      if (panel?.plot && panel.plot.width !== panel.width()) panel.plot.setSize({ width: panel.width(), height: height(panel.width()) });
    }
  });

  /** The list of quantities that have no panel yet. */
  function choices() {
    const select = document.getElementById("curve-add");
    const free = D.tasks[D.task].quantities.filter(({ key }) => !panels.some((panel) => panel.quantity.key === key));
    const groups = [...new Set(free.map(({ group }) => group))];
    select.replaceChildren(make("option", { value: "" }, panels.length >= MOST ? "no room for more" : "choose"),
      ...groups.map((group) => make("optgroup", { label: group },
        ...free.filter((one) => one.group === group).map(({ key, name }) => make("option", { value: key }, name)))));
  }

  /** Panels of the task that is shown: those that were there, as far as it has them. */
  function build() {
    const list = D.tasks[D.task].quantities;
    const known = panels.map((panel) => panel.quantity.key).filter((key) => list.some((one) => one.key === key));
    panels.forEach((panel) => { panel.plot?.destroy(); watch.unobserve(panel.element); });
    panels = [];
    threads = null;
    document.getElementById("panels").replaceChildren();
    (known.length ? known : first(list)).forEach(add);
    choices();
  }

  function show() {
    panels.forEach((panel) => panel.draw());
    keys();
  }

  /** More roll-outs, or none any more. */
  function setThreads(message) {
    if (!message) {
      threads = null;
    } else {
      if (threads?.id !== message.id) threads = { id: message.id, curves: new Map() };
      for (const { key, x, threads: list } of message.threads) {
        const known = threads.curves.get(key) ?? { x: unpack(x), list: [] };
        known.list.push(...list.map(unpack));
        threads.curves.set(key, known);
      }
    }
    panels.forEach((panel) => panel.plot?.redraw(false));
  }

  E.curves = {
    build, show, add, setThreads, unpack, wanted: () => panels.map((panel) => panel.quantity.key),
    redraw: () => panels.forEach((panel) => panel.plot?.redraw(false)),
    /** Least and greatest number of a panel's vertical axis. */
    range: (key) => {
      const { min, max } = panels.find((panel) => panel.quantity.key === key).plot.scales.y;
      return [min, max];
    },
  };
})(window.Explore);
