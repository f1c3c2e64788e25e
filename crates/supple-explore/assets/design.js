"use strict";
// The design on screen: the values of all sliders, where they have been, and pinned designs.
(function (E) {
  const MOST_STEPS = 200, MOST_TRAIL = 400, MOST_PINS = 3;
  const listeners = [];

  const D = {
    generation: 0, knobs: [], values: [], task: 0, tasks: [], parameters: [], initial: [],
    undone: [], done: [], trail: [], pins: [], latest: 0,

    /** The file as it was read, with sliders at their start, or where they were as far as they are still there. */
    begin(hello) {
      const before = new Map(D.knobs.map((knob, n) => [knob.name, D.values[n]]));
      const again = hello.generation === D.generation && D.knobs.length === hello.knobs.length;
      Object.assign(D, {
        generation: hello.generation, knobs: hello.knobs, tasks: hello.tasks, parameters: hello.parameters,
        initial: hello.initial, feasibility: hello.feasibility,
      });
      D.values = hello.knobs.map((knob) => (again ? before.get(knob.name) ?? knob.start : knob.start));
      D.task = Math.min(D.task, hello.tasks.length - 1);
      if (!again) Object.assign(D, { undone: [], done: [], trail: [], pins: [] });
    },

    onChange(listener) {
      listeners.push(listener);
    },

    tell(why) {
      listeners.forEach((listener) => listener(why));
    },

    /** A value within the ends of its slider, or any number where it may be typed. */
    allowed(index, value) {
      const { bounds: [low, high], open } = D.knobs[index];
      return open ? value : Math.min(high, Math.max(low, value));
    },

    /** Moves some sliders: `{ index: value }`. */
    move(changes) {
      const values = D.values.slice();
      for (const [index, value] of Object.entries(changes)) values[index] = D.allowed(Number(index), value);
      D.values = values;
      D.trail.push(values);
      if (D.trail.length > MOST_TRAIL) D.trail.shift();
      D.tell("move");
    },

    /** What undo returns to: called before a movement begins. */
    keep() {
      const last = D.done[D.done.length - 1];
      if (last && last.every((value, n) => value === D.values[n])) return;
      D.done.push(D.values.slice());
      if (D.done.length > MOST_STEPS) D.done.shift();
      D.undone = [];
    },

    /** A whole other design. */
    load(values) {
      D.keep();
      D.move(Object.fromEntries(values.map((value, n) => [n, value])));
    },

    undo() {
      const same = (values) => values.every((value, n) => value === D.values[n]);
      while (D.done.length && same(D.done[D.done.length - 1])) D.done.pop();
      if (!D.done.length) return;
      D.undone.push(D.values.slice());
      D.values = D.done.pop();
      D.trail.push(D.values);
      D.tell("move");
    },

    redo() {
      if (!D.undone.length) return;
      D.done.push(D.values.slice());
      D.values = D.undone.pop();
      D.trail.push(D.values);
      D.tell("move");
    },

    /** Pins the design on screen under the first free letter. */
    pin() {
      const name = ["A", "B", "C"].find((letter) => !D.pins.some((pin) => pin.name === letter));
      if (!name || D.pins.length >= MOST_PINS) return null;
      D.pins.push({ name, values: D.values.slice(), answer: null, details: null });
      D.pins.sort((a, b) => a.name.localeCompare(b.name));
      D.tell("pins");
      return name;
    },

    unpin(name) {
      D.pins = D.pins.filter((pin) => pin.name !== name);
      D.tell("pins");
    },
  };
  E.design = D;

  /** A number as people read it. */
  E.number = (value, digits = 4) => {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    const text = size >= 1e6 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
    const [mantissa, power] = text.split("e");
    const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
    return (power === undefined ? short : `${short}e${Number(power)}`).replace(/-/g, "−");
  };

  /** The texts of ticks, with as many digits as tell them apart. */
  E.distinct = (ticks, text = E.number) => {
    const texts = (digits) => ticks.map((tick) => (tick === null ? "" : text(tick, digits)));
    const wanted = new Set(ticks).size;
    for (let digits = 4; digits < 12; digits += 1) if (new Set(texts(digits)).size >= wanted) return texts(digits);
    return texts(12);
  };

  /** How many times as large as on a screen of usual size texts are. */
  E.larger = () => (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;

  /** Round numbers within two ends, at most so many: 1, 2 or 5 times powers of ten apart; on a logarithmic scale at those numbers. */
  E.ticks = ({ scale, bounds: [low, high] }, most) => {
    const steps = (factors, from, to) => {
      const list = [];
      for (let power = from; power <= to; power += 1) for (const factor of factors) list.push(Number(`${factor}e${power}`));
      return list;
    };
    const inside = (list) => {
      const slack = 1e-9 * (high - low);
      return list.filter((value) => value >= low - slack && value <= high + slack);
    };
    if (!(high > low)) return [low];
    if (scale === "log") {
      const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
      for (const factors of [[1, 2, 5], [1, 3], [1]]) {
        const list = inside(steps(factors, from, to));
        if (list.length >= 2 && list.length <= most) return list;
      }
      const powers = inside(steps([1], from, to));
      if (powers.length > most) return powers.filter((_, n) => n % Math.ceil(powers.length / most) === 0);
    }
    const power = Math.floor(Math.log10((high - low) / most));
    for (const step of steps([1, 2, 5], power, power + 1)) {
      const first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first + 1;
      // Products of whole numbers and powers of ten have needless digits.
      if (count <= most) return Array.from({ length: count }, (_, n) => Number(((first + n) * step).toPrecision(12)));
    }
    return [low, high];
  };

  /** An element with attributes and children. */
  E.make = (tag, attributes, ...children) => {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value !== false && value !== undefined && value !== null) node.setAttribute(key, value === true ? "" : value);
    }
    node.append(...children.filter((child) => child !== null && child !== undefined));
    return node;
  };

  /**
   * Does something once what was drawn is on the screen: browsers without a graphics card would otherwise queue pictures
   * faster than they paint them, and stop answering. Pages that are not seen paint nothing.
   */
  E.painted = (then) => {
    let open = true;
    const once = () => {
      if (open) then();
      open = false;
    };
    if (!document.hidden) requestAnimationFrame(() => requestAnimationFrame(once));
    setTimeout(once, document.hidden ? 30 : 1000);
  };

  /** Where a value stands on its slider, from 0 to 1, and the value at such a place. */
  E.share = ({ scale, bounds: [low, high] }, value) =>
    (scale === "log" ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
  E.valueAt = ({ scale, bounds: [low, high] }, share) => {
    if (share <= 0) return low;
    if (share >= 1) return high;
    return scale === "log" ? low * (high / low) ** share : low + share * (high - low);
  };
})(window.Explore);
