"use strict";
// A map over two sliders, and its designs by information and cost.
(function (E) {
  const D = E.design, make = E.make;
  // Viridis, at nine places.
  const STOPS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
  const NAMES = { measured: "measured information, bits", used: "used information, bits", excess: "cost above its limit, %", price: "shadow price, bits per unit of cost" };
  const PLACES = { measured: 2, used: 3, excess: 4, cost: 5, price: 6 };
  const element = (id) => document.getElementById(id);
  const map = { axes: null, gaps: 32, grid: new Map(), id: 0, done: [0, 0], path: [] };
  let queued = false, late = false, basis = "", front = [];

  function tint(share) {
    const at = Math.max(0, Math.min(1, share)) * (STOPS.length - 1), n = Math.min(STOPS.length - 2, Math.floor(at));
    return STOPS[n].map((value, c) => Math.round(value + (at - n) * (STOPS[n + 1][c] - value)));
  }

  /** The lists of sliders along the axes. */
  function build() {
    const usable = D.knobs.map((knob, n) => [knob, n]);
    if (usable.length < 2) {
      element("map").hidden = true;
      return;
    }
    element("map").hidden = false;
    const first = usable.filter(([knob]) => knob.designed).concat(usable.filter(([knob]) => !knob.designed)).slice(0, 2).map(([, n]) => n);
    ["map-x", "map-y"].forEach((id, axis) => {
      element(id).replaceChildren(...usable.map(([knob, n]) => make("option", { value: n, selected: n === first[axis] }, knob.name)));
    });
    basis = "";
    map.path = [];
    ask();
  }

  /** All that a map depends on, but for the sliders along its axes. */
  function key() {
    const [x, y] = axes();
    const rest = D.values.filter((_, n) => n !== x && n !== y);
    return JSON.stringify([D.generation, x, y, element("map-of").value === "price", rest]);
  }

  function axes() {
    return [Number(element("map-x").value), Number(element("map-y").value)];
  }

  /** Asks for the map anew where it is of something else than what is on screen. */
  function ask() {
    if (element("map").hidden || key() === basis) return;
    const [x, y] = axes();
    if (x === y) {
      element("map-note").textContent = "Choose two different sliders.";
      return;
    }
    basis = key();
    Object.assign(map, { axes: [x, y], grid: new Map(), done: [0, 0] });
    element("map-note").dataset.done = "false";
    map.id = E.link.ask("map", { values: D.values, axes: [x, y], prices: element("map-of").value === "price" });
    draw();
  }

  function take(message) {
    if (message.id !== map.id) return;
    if (message.error) {
      element("map-note").textContent = `The map cannot be computed: ${message.error}`;
      return;
    }
    map.gaps = message.gaps;
    map.done = message.done;
    element("map-note").dataset.done = String(map.done[0] === map.done[1]);
    for (const point of message.points) map.grid.set(point[0] + point[1] * (map.gaps + 1), point);
    draw();
  }

  /** The number of a place: its own, or that of the nearest coarser one that is known. */
  function value(i, j, place) {
    for (let step = 1; step <= map.gaps; step *= 2) {
      const [a, b] = [i - (i % step), j - (j % step)];
      for (const [p, q] of [[a, b], [Math.min(map.gaps, a + step), b], [a, Math.min(map.gaps, b + step)]]) {
        const point = map.grid.get(p + q * (map.gaps + 1));
        if (point) return point[place];
      }
    }
    return undefined;
  }

  function range(place) {
    const all = [...map.grid.values()].map((point) => point[place]).filter((v) => v !== null && Number.isFinite(v)).sort((a, b) => a - b);
    if (!all.length) return [0, 1];
    // A few points that are far away do not flatten the rest.
    const low = all[Math.floor(0.02 * (all.length - 1))], high = all[Math.ceil(0.98 * (all.length - 1))];
    return high > low ? [low, high] : [low - 0.5, low + 0.5];
  }

  function sized(canvas, ratio) {
    const width = canvas.clientWidth || 300, height = Math.round(width * ratio), scale = Math.min(2, window.devicePixelRatio || 1);
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      canvas.style.height = `${height}px`;
    }
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = `${11 * E.larger()}px system-ui, sans-serif`;
    return [context, width, height];
  }

  /** The area within the axes: texts beside it grow with those of the page. */
  const frame = (width, height) => {
    const [left, right, top, bottom] = [56, 12, 9, 36].map((room) => room * E.larger());
    return { x: left, y: top, w: width - left - right, h: height - top - bottom };
  };

  function draw() {
    if (queued) {
      late = true;
      return;
    }
    queued = true;
    late = false;
    if (map.axes) drawMap();
    drawFront();
    E.painted(() => {
      queued = false;
      if (late) draw();
    });
  }

  function drawMap() {
    const canvas = element("map-canvas");
    if (!canvas.clientWidth) return;
    const [context, width, height] = sized(canvas, 0.8), box = frame(width, height);
    const of = element("map-of").value, place = PLACES[of], [low, high] = range(place), count = map.gaps + 1;
    const image = new ImageData(count, count);
    for (let j = 0; j < count; j += 1) {
      for (let i = 0; i < count; i += 1) {
        const found = value(i, j, place), excess = value(i, j, 4), at = 4 * (i + (map.gaps - j) * count);
        if (found === undefined || found === null) continue;
        const shade = tint((found - low) / (high - low)), out = excess !== null && excess > D.feasibility;
        shade.forEach((v, c) => { image.data[at + c] = out ? 0.4 * v + 0.6 * 215 : v; });
        image.data[at + 3] = 255;
      }
    }
    const small = new OffscreenCanvas(count, count);
    small.getContext("2d").putImageData(image, 0, 0);
    context.imageSmoothingEnabled = false;
    const cell = [box.w / map.gaps, box.h / map.gaps];
    context.save();
    context.beginPath();
    context.rect(box.x, box.y, box.w, box.h);
    context.clip();
    context.drawImage(small, box.x - cell[0] / 2, box.y - cell[1] / 2, box.w + cell[0], box.h + cell[1]);
    limitLine(context, box);
    ways(context, box);
    context.restore();
    marks(context, box);
    frameAxes(context, box, map.axes.map((index) => D.knobs[index]), height);
    legend(of, low, high, canvas);
  }

  /** Where the worst task is at its limit, by marching squares over the finest grid that is complete. */
  function limitLine(context, box) {
    let step = 1;
    while (step < map.gaps && map.grid.size < (map.gaps / step + 1) ** 2) step *= 2;
    const at = (i, j) => map.grid.get(i + j * (map.gaps + 1))?.[4];
    context.strokeStyle = "#fff";
    context.lineWidth = 3;
    const path = new Path2D();
    for (let j = 0; j + step <= map.gaps; j += step) {
      for (let i = 0; i + step <= map.gaps; i += step) {
        const corners = [[i, j], [i + step, j], [i + step, j + step], [i, j + step]];
        const values = corners.map(([p, q]) => at(p, q));
        if (values.some((v) => v === null || v === undefined)) continue;
        const cut = corners.flatMap((corner, n) => {
          const [a, b] = [values[n], values[(n + 1) % 4]], next = corners[(n + 1) % 4];
          if ((a > 0) === (b > 0)) return [];
          const share = a / (a - b);
          return [[corner[0] + share * (next[0] - corner[0]), corner[1] + share * (next[1] - corner[1])]];
        });
        for (let n = 0; n + 1 < cut.length; n += 2) {
          const [p, q] = [cut[n], cut[n + 1]].map(([u, v]) => [box.x + (u / map.gaps) * box.w, box.y + (1 - v / map.gaps) * box.h]);
          path.moveTo(...p);
          path.lineTo(...q);
        }
      }
    }
    context.stroke(path);
    context.strokeStyle = "#d62728";
    context.lineWidth = 1.5;
    context.stroke(path);
  }

  function position(values, box) {
    const [u, v] = map.axes.map((index) => E.share(D.knobs[index], values[index]));
    return [box.x + u * box.w, box.y + (1 - v) * box.h];
  }

  function line(context, list, box, colour, dash) {
    if (list.length < 2) return;
    context.beginPath();
    list.forEach((values, n) => (n ? context.lineTo(...position(values, box)) : context.moveTo(...position(values, box))));
    context.setLineDash(dash);
    context.strokeStyle = "rgba(0,0,0,0.55)";
    context.lineWidth = 3;
    context.stroke();
    context.strokeStyle = colour;
    context.lineWidth = 1.2;
    context.stroke();
    context.setLineDash([]);
  }

  function dot(context, [x, y], colour, text) {
    context.beginPath();
    context.arc(x, y, (text ? 8 : 6) * E.larger(), 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = "#fff";
    context.stroke();
    if (!text) return;
    context.fillStyle = "#fff";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(text, x, y);
  }

  /** Where one was, and the way of the search. */
  function ways(context, box) {
    line(context, D.trail.slice(-150), box, "#fff", []);
    line(context, map.path, box, "#ffb454", [4, 3]);
  }

  /** Pins, and where one is: whole also at the ends of ranges, where searches often end. */
  function marks(context, box) {
    D.pins.forEach((pin) => dot(context, position(pin.values, box), "#7a2f63", pin.name));
    dot(context, position(D.values, box), "#d62728", "");
  }

  /** The text of a tick, short enough to stand beside the name of its axis. */
  function tickText(value, digits) {
    if (Math.abs(value) < 1e4) return E.number(value, Math.max(6, digits));
    const power = Math.floor(Math.log10(Math.abs(value)) + 1e-9);
    return `${E.number(value / 10 ** power, digits)}e${power}`;
  }

  function frameAxes(context, box, [x, y], height) {
    const size = 11 * E.larger(), middle = box.y + box.h / 2;
    context.strokeStyle = SuppleTheme.colour("@ink/0.5");
    context.lineWidth = 1;
    context.strokeRect(box.x, box.y, box.w, box.h);
    context.fillStyle = SuppleTheme.colour("@ink");
    context.beginPath();
    context.textAlign = "center";
    context.textBaseline = "top";
    let free = -Infinity;
    const across = E.ticks(x, Math.max(2, Math.min(7, Math.floor(box.w / (4 * size))))), texts = E.distinct(across, tickText);
    for (const [n, value] of across.entries()) {
      const text = texts[n], half = context.measureText(text).width / 2, at = box.x + E.share(x, value) * box.w;
      context.moveTo(at, box.y + box.h);
      context.lineTo(at, box.y + box.h + 4);
      if (at - half < free) continue;
      context.fillText(text, Math.min(at, box.x + box.w + 11 - half), box.y + box.h + 6);
      free = at + half + 0.5 * size;
    }
    context.fillText(`${x.name}${x.unit ? `, ${x.unit}` : ""}`, box.x + box.w / 2, height - size - 2);
    context.textAlign = "right";
    context.textBaseline = "middle";
    const up = E.ticks(y, Math.max(2, Math.min(7, Math.floor(box.h / (2.5 * size))))), names = E.distinct(up, tickText);
    for (const [n, value] of up.entries()) {
      const at = box.y + (1 - E.share(y, value)) * box.h;
      context.moveTo(box.x, at);
      context.lineTo(box.x - 4, at);
      context.fillText(names[n], box.x - 6, at);
    }
    context.stroke();
    context.save();
    context.translate(size, middle);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(`${y.name}${y.unit ? `, ${y.unit}` : ""}`, 0, 0);
    context.restore();
  }

  function legend(of, low, high, canvas) {
    const scale = of === "excess" ? 100 : 1, [done, total] = map.done;
    const progress = total && done < total ? ` ${done} of ${total} designs.` : "";
    const lost = [...map.grid.values()].filter((point) => point[2] === null).length;
    const gaps = lost ? ` ${lost} designs have no plan.` : "";
    const note = `Colours: ${of === "cost" ? costName() : NAMES[of]}, from ${E.number(scale * low, 3)} (dark) to ${E.number(scale * high, 3)} (light). Pale: above a cost limit; red line: at it.${gaps}${progress}`;
    element("map-note").textContent = note;
    canvas.setAttribute("aria-label", `Map over ${D.knobs[map.axes[0]].name} and ${D.knobs[map.axes[1]].name}. Arrow keys move the design on screen, a click moves it there. ${note}`);
  }

  /** What the cost of a design is: that of the one task, or of all. */
  function costName() {
    return D.tasks.length > 1 ? "expected cost, sum of all tasks" : "expected cost";
  }

  /** The points of the map by cost and information; those that no other one beats in both are the front. */
  function drawFront() {
    const canvas = element("front-canvas");
    if (!canvas.clientWidth || !map.axes) return;
    const [context, width, height] = sized(canvas, 0.55), box = frame(width, height);
    const points = [...map.grid.values()].filter((point) => point[2] !== null && Number.isFinite(point[5]));
    if (points.length < 2) return;
    const sorted = points.slice().sort((a, b) => a[5] - b[5] || a[2] - b[2]);
    let least = Infinity;
    front = sorted.filter((point) => (point[2] < least ? ((least = point[2]), true) : false));
    const ends = (place) => {
      const all = points.map((point) => point[place]).sort((a, b) => a - b), top = all[Math.ceil(0.95 * (all.length - 1))];
      // Numbers that are the same but for rounding stand in the middle.
      const same = top - all[0] <= 1e-9 * Math.abs(top), half = 0.5 * (Math.abs(top) || 1);
      return same ? [top - half, top + half] : [all[0], top + 0.05 * (top - all[0])];
    };
    const [costs, bits] = [ends(5), ends(2)];
    canvas.ends = { costs, bits, box };
    const at = (cost, info) => [box.x + ((cost - costs[0]) / (costs[1] - costs[0])) * box.w, box.y + (1 - (info - bits[0]) / (bits[1] - bits[0])) * box.h];
    context.save();
    context.beginPath();
    const room = 9 * E.larger();
    context.rect(box.x - room, box.y - room, box.w + 2 * room, box.h + 2 * room);
    context.clip();
    context.fillStyle = SuppleTheme.colour("@7/0.35");
    points.filter((point) => point[5] <= costs[1] && point[2] <= bits[1]).forEach((point) => { const [x, y] = at(point[5], point[2]); context.fillRect(x - 1.5, y - 1.5, 3, 3); });
    context.fillStyle = SuppleTheme.colour("@1");
    front.filter((point) => point[5] <= costs[1] && point[2] <= bits[1]).forEach((point) => { const [x, y] = at(point[5], point[2]); context.fillRect(x - 3, y - 3, 6, 6); });
    const cost = (numbers) => numbers.tasks.reduce((sum, task) => sum + task.expected, 0);
    D.pins.filter((pin) => pin.answer).forEach((pin) => dot(context, at(cost(pin.answer.numbers), pin.answer.numbers.measured), "#7a2f63", pin.name));
    if (E.now) dot(context, at(cost(E.now.numbers), E.now.numbers.measured), "#d62728", "");
    context.restore();
    const linear = (name, [from, to]) => ({ name, unit: "", scale: "linear", bounds: [from, to] });
    frameAxes(context, box, [linear(costName(), costs), linear("measured, bits", bits)], height);
    const note = `${front.length} of ${points.length} designs of the map are Pareto-optimal (blue). Click to show the nearest one; the arrow keys move along them.`;
    element("front-note").textContent = note;
    canvas.setAttribute("aria-label", `Designs by ${costName()} and measured information. ${note}`);
  }

  function goTo(point) {
    D.load(D.values.map((value, n) => {
      const axis = map.axes.indexOf(n);
      return axis < 0 ? value : E.valueAt(D.knobs[n], point[axis] / map.gaps);
    }));
  }

  function listen() {
    const canvas = element("map-canvas");
    const go = (event) => {
      if (!map.axes) return;
      const at = canvas.getBoundingClientRect(), box = frame(at.width, at.height);
      const share = [(event.clientX - at.left - box.x) / box.w, 1 - (event.clientY - at.top - box.y) / box.h];
      if (event.type === "pointerdown") D.keep();
      E.moved = performance.now();
      D.move(Object.fromEntries(map.axes.map((index, axis) => [index, E.valueAt(D.knobs[index], share[axis])])));
    };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); go(event); });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step || !map.axes) return;
      event.preventDefault();
      if (!event.repeat) D.keep();
      E.moved = performance.now();
      D.move(Object.fromEntries(map.axes.map((index, axis) =>
        [index, E.valueAt(D.knobs[index], E.share(D.knobs[index], D.values[index]) + step[axis] / map.gaps)])));
    });
    const other = element("front-canvas");
    other.addEventListener("click", (event) => {
      if (!other.ends || !front.length) return;
      const at = other.getBoundingClientRect(), { costs, bits, box } = other.ends;
      const far = (point) => Math.hypot(box.x + ((point[5] - costs[0]) / (costs[1] - costs[0])) * box.w - (event.clientX - at.left),
        box.y + (1 - (point[2] - bits[0]) / (bits[1] - bits[0])) * box.h - (event.clientY - at.top));
      goTo(front.reduce((best, point) => (far(point) < far(best) ? point : best)));
    });
    other.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step || !front.length) return;
      event.preventDefault();
      other.at = Math.max(0, Math.min(front.length - 1, (other.at ?? -1) + step));
      goTo(front[other.at]);
    });
    ["map-x", "map-y", "map-of"].forEach((id) => element(id).addEventListener("change", () => { ask(); draw(); }));
    new ResizeObserver(draw).observe(canvas);
  }

  E.map = { build, ask, take, draw, listen, visited: (values) => { map.path.push(values); draw(); }, state: map };
})(window.Explore);
