// The view of a robot in motion: `SuppleScene.mount(element, data)` with the data of supple-report's `scene::data`.
// Needs plotly.js as the global `Plotly`. `element.dataset.frame` is the number of the frame that is shown.
(function (S) {
  "use strict";
  const G = S.geometry, F = S.figure;
  const SPEEDS = [1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01];
  const FACTORS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
  const CSS = `
.supple-scene { display: flex; flex-direction: column; gap: 0.5rem; color: inherit; }
.supple-scene-view { height: var(--supple-scene-height, 26rem); outline-offset: 2px; touch-action: none; }
.supple-scene-view:focus-visible { outline: 2px solid currentColor; }
.supple-scene-controls { display: flex; flex-wrap: wrap; gap: 0.4rem 0.9rem; align-items: center; font-size: 0.875rem; }
.supple-scene-controls label { display: inline-flex; gap: 0.35rem; align-items: center; }
.supple-scene-controls .supple-scene-time { flex: 1 1 14rem; }
.supple-scene-time input { flex: 1 1 6rem; min-width: 5rem; }
.supple-scene-controls output { font-variant-numeric: tabular-nums; white-space: nowrap; }
.supple-scene-controls button, .supple-scene-controls select { font: inherit; color: inherit; background: transparent;
  border: 1px solid currentColor; border-radius: 0.3rem; padding: 0.2rem 0.6rem; min-height: 1.9rem; }
.supple-scene-controls option { color: #000; background: #fff; }
.supple-scene-play { min-width: 4.6rem; }
.supple-scene-note { font-size: 0.8125rem; opacity: 0.85; margin: 0; }
.supple-scene-legend { display: flex; flex-wrap: wrap; gap: 0.1rem 1.1rem; padding: 0; list-style: none; max-width: none; }
.supple-scene-print { display: none; }
@media print {
  .supple-scene-view, .supple-scene-controls { display: none; }
  .supple-scene-print { display: flex; gap: 0.5rem; }
  .supple-scene-print figure { flex: 1 1 0; margin: 0; min-width: 0; }
  .supple-scene-print img { display: block; width: 100%; }
  .supple-scene-key { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
.supple-scene-key { display: inline-block; width: 0.9em; height: 0.9em; border-radius: 0.15em; vertical-align: -0.08em; }`;

  function make(tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value !== false && value !== undefined) node.setAttribute(key, value === true ? "" : value);
    }
    node.append(...children);
    return node;
  }

  function addStyle() {
    if (!document.getElementById("supple-scene-style")) {
      document.head.append(make("style", { id: "supple-scene-style" }, CSS));
    }
  }

  /** A number with three digits and no needless zeros. */
  function short(value) {
    return String(Number(value.toPrecision(3)));
  }

  class View {
    constructor(element, data, prepared) {
      this.element = element;
      const meshes = data.meshes.map((mesh) => ({
        vertices: new Float32Array(G.bytes(mesh.vertices)),
        faces: new Uint32Array(G.bytes(mesh.faces)),
      }));
      this.take(prepared || data.designs.map((design, index) => F.prepare(design, meshes, index)));
      this.scales = F.scales(this.designs);
      this.box = F.bounds(this.designs, this.scales);
      this.home = F.camera(this.box);
      this.eye = this.home;
      this.show = { forces: true, pulls: true, beliefs: true };
      this.overlaid = false;
      this.playing = false;
      this.frame = 0;
      this.drawn = 0;
      this.warnings = data.warnings || [];
    }

    /** The designs that are shown. The one that lasts longest gives the frames; others are shown at the same time. */
    take(designs) {
      this.designs = designs;
      this.master = designs.reduce((best, d) => (this.end(d) > this.end(best) ? d : best), designs[0]);
    }

    /**
     * Shows other designs, prepared by `SuppleScene.figure.prepare`, at the frame that is shown. The camera stays, and the box
     * as long as it fits; scales change only by much, so that arrows can be compared.
     */
    replace(designs) {
      const before = this.traces.map(({ kind, index, design }) => [kind, index, design.model]);
      const names = this.designs.map((design) => design.name).join();
      this.take(designs);
      this.rescale();
      this.describe();
      const fresh = F.bounds(designs, this.scales), fits = F.fits(this.box, fresh);
      if (!fits) this.box = fresh;
      const frame = Math.min(this.frame, this.master.time.length - 1);
      this.range.max = String(this.master.time.length - 1);
      const now = this.plan();
      const same = fits && names === designs.map((design) => design.name).join() && now.length === before.length
        && now.every(({ kind, index, design }, n) =>
          kind === before[n][0] && index === before[n][1] && (kind !== "bodies" || design.model === before[n][2]));
      this.traces = now;
      this.frame = frame;
      if (same) this.go(frame);
      else if (this.busy) this.busy.then(() => this.draw());
      else this.draw();
    }

    rescale() {
      const fresh = F.scales(this.designs);
      const far = (a, b) => !(a / b < 3 && b / a < 3);
      if (["force", "pull", "torque", "belief"].every((key) => !far(fresh[key], this.scales[key]))) return;
      this.scales = fresh;
    }

    end(design) {
      return design.time[design.time.length - 1];
    }

    build() {
      addStyle();
      this.view = make("div", {
        class: "supple-scene-view", tabindex: "0", role: "application",
        "aria-label": "Three-dimensional view of the motion. Arrow keys turn it, plus and minus zoom, Home resets.",
        onkeydown: (event) => this.key(event),
      });
      this.element.classList.add("supple-scene");
      this.still = make("div", { class: "supple-scene-print" });
      this.element.replaceChildren(this.view, this.still, this.controls(), this.note());
      this.draw();
      this.listen();
    }

    controls() {
      const count = this.master.time.length;
      this.button = make("button", { type: "button", class: "supple-scene-play", onclick: () => this.toggle() }, "Play");
      this.range = make("input", {
        type: "range", min: "0", max: String(count - 1), step: "1", value: "0",
        oninput: () => { this.pause(); this.go(Number(this.range.value)); },
      });
      this.output = make("output", {});
      const box = (label, key) => make("label", {}, make("input", {
        type: "checkbox", checked: this.show[key],
        onchange: (event) => { this.show[key] = event.target.checked; this.describe(); this.draw(); },
      }), label);
      const list = (label, options, chosen, use) => {
        const select = make("select", { onchange: (event) => use(event.target.value) },
          ...options.map(([value, text]) => make("option", { value, selected: value === chosen }, text)));
        return make("label", {}, label, select);
      };
      // As fast as the real thing, or so slow that the motion takes some seconds.
      const real = this.end(this.master);
      this.speed = SPEEDS.find((speed) => real / speed >= 3) || SPEEDS[SPEEDS.length - 1];
      const speeds = SPEEDS.map((speed) => [speed, speed === 1 ? "real time" : `1/${Math.round(1 / speed)}`]);
      const parts = [
        this.button,
        make("label", { class: "supple-scene-time" }, "Time", this.range, this.output),
        list("Speed", speeds, this.speed, (value) => { this.speed = Number(value); this.anchor(); }),
      ];
      if (this.designs.length > 1) {
        parts.push(list("Designs", [["beside", "side by side"], ["over", "overlaid"]], "beside", (value) => {
          this.overlaid = value === "over";
          this.draw();
        }));
      }
      if (this.any("forces")) parts.push(box("Contact forces", "forces"));
      if (this.any("pulls") || this.any("torques")) parts.push(box("Spring forces", "pulls"));
      if (this.any("beliefs") || this.any("bands")) {
        parts.push(box("Belief", "beliefs"));
        parts.push(list("Belief drawn", FACTORS.map((f) => [f, `${f} ×`]), this.scales.belief, (value) => {
          this.scales.belief = Number(value);
          this.describe();
          this.update();
        }));
      }
      parts.push(make("button", { type: "button", onclick: () => this.look(this.home) }, "Reset view"));
      return make("div", { class: "supple-scene-controls", role: "group", "aria-label": "Motion" }, ...parts);
    }

    any(kind) {
      return this.designs.some((design) => F.has(kind, design));
    }

    note() {
      this.text = make("ul", { class: "supple-scene-note supple-scene-legend", "aria-label": "Legend of the view" });
      this.describe();
      const warnings = this.warnings.map((warning) => make("p", { class: "supple-scene-note" }, `Warning: ${warning}.`));
      return make("div", {}, this.text, ...warnings);
    }

    /** The legend: colours in words, and scales. */
    describe() {
      const { dark } = this.colours(), shared = F.palette(dark), own = (design) => F.colour(design.index, dark);
      const key = (colour, opacity = 1) => make("span", {
        class: "supple-scene-key", style: `background:${colour};opacity:${opacity}`, "aria-hidden": "true",
      });
      const near = this.scales.size < 0.5;
      const per = (scale, unit) => (near ? `1\u00a0cm is ${short(scale / 100)}\u00a0${unit}` : `10\u00a0cm is ${short(scale / 10)}\u00a0${unit}`);
      const parts = [];
      const line = (keys, text) => parts.push(make("li", {}, ...keys, ` ${text}`));
      const several = this.designs.length > 1, bodies = this.designs.flatMap((design) => design.bodies);
      if (several) this.designs.forEach((design) => line([key(own(design))], `bodies of ${design.name}`));
      else if (bodies.some(F.moves)) line([key(own(this.designs[0]))], "moving bodies");
      if (bodies.some((body) => !F.moves(body))) line([key(shared.fixed)], "fixed bodies");
      if (this.any("walls")) line([key(shared.wall, 0.5)], "walls");
      if (this.any("springs")) line([key(shared.spring)], "springs (coils)");
      if (this.any("forces") && this.show.forces) {
        line([key(shared.force)], `contact force on the robot (thick arrows): ${per(this.scales.force, "N")}`);
      }
      if (this.any("pulls") && this.show.pulls) {
        line([key(shared.spring)], `spring force on the body at the arrow (thin): ${per(this.scales.pull, "N")}`);
      }
      if (this.any("torques") && this.show.pulls) {
        line([key(shared.torque)], `spring torque (two heads): ${per(this.scales.torque, "N·m")}`);
      }
      if ((this.any("beliefs") || this.any("bands")) && this.show.beliefs) {
        const factor = this.scales.belief;
        const larger = factor === 1 ? "to scale" : `drawn ${factor} times as large`;
        const what = [this.any("beliefs") && "points (ellipsoids)", this.any("bands") && "walls (bands)"];
        const text = `estimation error of ${what.filter(Boolean).join(" and ")}: 2 standard deviations, ${larger}`;
        line(this.designs.map((design) => key(own(design), 0.4)), text);
      }
      this.text.replaceChildren(...parts);
    }

    /** Whether the page is dark, by the colour of its text; and that colour. Prints are light. */
    colours() {
      const text = this.printing ? "#000000" : getComputedStyle(this.element).color;
      const [r, g, b] = this.printing ? [0, 0, 0] : (text.match(/[\d.]+/g) || [0, 0, 0]).map(Number);
      const dark = 0.299 * r + 0.587 * g + 0.114 * b > 140;
      // Opaque: the plot would blend what is translucent with more than its background.
      const paper = dark ? 24 : 255;
      const faint = `rgb(${[r, g, b].map((v) => Math.round(paper + 0.18 * (v - paper))).join()})`;
      return { text, dark, faint };
    }

    style() {
      // Scenes below one another need room each; those beside one another are no higher than they are wide, or nearly so.
      const scenes = this.overlaid ? 1 : this.designs.length, rows = this.view.clientWidth < 640 ? scenes : 1;
      const most = Math.round((1.05 * this.view.clientWidth) / scenes), high = "var(--supple-scene-height, 26rem)";
      this.view.style.height = rows > 1 ? `calc(${0.6 * rows} * ${high})` : `min(${high}, max(${most}px, 16rem))`;
      const { text, dark, faint } = this.colours();
      const { clientWidth: width, clientHeight: height } = this.view, narrow = width < 640;
      const count = this.overlaid ? 1 : this.designs.length;
      const aspect = (narrow ? width / (height / count) : width / count / height) || 1;
      const size = (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
      return { text, faint, dark, narrow, aspect, size };
    }

    /** Which traces there are: kind and design of each. */
    plan() {
      const kinds = F.KINDS.filter((kind) => this.show.beliefs || (kind !== "beliefs" && kind !== "bands"));
      return this.designs.flatMap((design, index) =>
        kinds.filter((kind) => F.has(kind, design)).map((kind) => ({ kind, design, index })));
    }

    /** Draws all anew. */
    draw() {
      const style = this.style(), count = this.overlaid ? 1 : this.designs.length;
      Object.assign(this, { narrow: style.narrow, aspect: style.aspect });
      this.traces = this.plan();
      const traces = this.traces.map(({ kind, design, index }) => {
        const scene = this.overlaid || !index ? "scene" : `scene${index + 1}`;
        const coordinates = F.shape(kind, design, this.frameOf(design), this.scales, this.show);
        return F.trace(kind, design, coordinates, { ...style, scene, opacity: this.overlaid && index ? 0.55 : 1 });
      });
      const names = this.overlaid || this.designs.length < 2 ? [] : this.designs.map((design) => design.name);
      const layout = F.layout(count, this.box, this.eye, style, names);
      const done = Plotly.react(this.view, traces, layout, {
        displayModeBar: false, responsive: false,
        // By itself plotly draws twice as many pixels each way: four times the work where there is no graphics card.
        plotGlPixelRatio: Math.min(2, window.devicePixelRatio || 1),
      });
      return this.until(done);
    }

    /**
     * A picture for print, where the view itself is blank: browsers keep no drawing of WebGL beyond the moment in which it is
     * shown. Called when a print begins, it ends before the print does. It shows the frame that the reader chose, or else the
     * one with the greatest contact force.
     */
    print(begins) {
      this.printing = begins;
      const { frame } = this, isChosen = frame > 0 && !this.playing;
      if (begins && !isChosen) this.frame = F.strongest(this.master);
      this.describe();
      this.draw();
      if (begins) this.keep();
      this.frame = frame;
    }

    /** Keeps pictures of what is drawn. */
    keep() {
      const scenes = Object.keys(this.view._fullLayout || {}).filter((key) => /^scene\d*$/.test(key));
      const time = `at ${this.master.time[this.frame].toPrecision(3)} s`;
      this.still.replaceChildren(...scenes.map((key, n) => {
        const name = scenes.length > 1 ? this.designs[n].name : "The motion";
        const text = `${name} ${time}`;
        const src = this.view._fullLayout[key]._scene.toImage("png");
        return make("figure", {}, make("img", { src, alt: text }), make("figcaption", {}, text));
      }));
    }

    /** Moves what is drawn to the frame. */
    update() {
      if (this.busy) {
        this.late = true;
        return;
      }
      const fixed = (kind, design) => kind === "walls" && design.walls.every((wall) => wall.position.length < 2);
      const moved = this.traces.map((trace, place) => ({ ...trace, place })).filter((t) => !fixed(t.kind, t.design));
      const shapes = moved.map(({ kind, design }) => F.shape(kind, design, this.frameOf(design), this.scales, this.show));
      const all = (axis) => shapes.map((shape) => shape[axis]);
      this.until(Plotly.restyle(this.view, { x: all("x"), y: all("y"), z: all("z") }, moved.map(({ place }) => place)));
    }

    /**
     * Busy until the picture is on the screen: a browser without a graphics card would otherwise queue pictures faster than
     * it paints them, and stop answering.
     */
    until(done) {
      const painted = () => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      this.busy = Promise.resolve(done).then(() => (document.hidden ? null : painted())).then(() => {
        this.busy = null;
        this.shown();
      });
      return this.busy;
    }

    shown() {
      this.drawn += 1;
      this.element.dataset.drawn = String(this.drawn);
      // What was asked for meanwhile.
      if (this.late) {
        this.late = false;
        this.update();
      }
    }

    /** The frame of a design at the time of the frame that is shown. */
    frameOf(design) {
      if (design === this.master) return this.frame;
      const now = this.master.time[this.frame], times = design.time;
      let frame = Math.min(this.frame, times.length - 1);
      while (frame + 1 < times.length && times[frame + 1] <= now * (1 + 1e-9)) frame += 1;
      while (frame > 0 && times[frame] > now * (1 + 1e-9)) frame -= 1;
      return frame;
    }

    go(frame) {
      this.frame = frame;
      this.element.dataset.frame = String(frame);
      this.range.value = String(frame);
      const text = `${this.master.time[frame].toPrecision(3)} s of ${short(this.end(this.master))} s`;
      this.output.textContent = text;
      this.range.setAttribute("aria-valuetext", text);
      this.update();
    }

    toggle() {
      if (this.playing) this.pause();
      else this.play();
    }

    pause() {
      this.playing = false;
      this.button.textContent = "Play";
    }

    play() {
      if (this.playing) return;
      this.playing = true;
      this.button.textContent = "Pause";
      if (this.frame >= this.master.time.length - 1) this.go(0);
      this.anchor();
      const step = (now) => {
        if (!this.playing || !this.element.isConnected) return;
        this.advance(now);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    /** Time goes on from the frame that is shown. */
    anchor() {
      this.start = performance.now() - (1000 * this.master.time[this.frame]) / this.speed;
    }

    advance(now) {
      if (this.hidden || document.hidden) return this.anchor();
      if (this.busy) return undefined;
      const time = Math.max(0, ((now - this.start) / 1000) * this.speed), times = this.master.time;
      // The end is shown for a second, then it begins again.
      if (time > this.end(this.master) + this.speed) {
        this.go(0);
        return this.anchor();
      }
      let frame = this.frame;
      while (frame + 1 < times.length && times[frame + 1] <= time) frame += 1;
      if (frame !== this.frame) this.go(frame);
      return undefined;
    }

    /** All scenes from one place. */
    look(eye) {
      this.eye = eye;
      const change = {};
      const count = this.overlaid ? 1 : this.designs.length;
      for (let n = 0; n < count; n++) change[n ? `scene${n + 1}.camera` : "scene.camera"] = eye;
      this.turning = true;
      Promise.resolve(Plotly.relayout(this.view, change)).then(() => { this.turning = false; });
    }

    key(event) {
      const { x, y, z } = this.eye.eye;
      const far = Math.hypot(x, y, z), angle = Math.atan2(y, x), height = Math.asin(z / far);
      const move = (turn, rise, zoom) => {
        const up = Math.max(-1.5, Math.min(1.5, height + rise)), out = Math.max(0.15, Math.min(8, far * zoom));
        const side = out * Math.cos(up);
        const eye = { x: side * Math.cos(angle + turn), y: side * Math.sin(angle + turn), z: out * Math.sin(up) };
        this.look({ ...this.eye, eye });
      };
      const keys = {
        ArrowLeft: () => move(-0.15, 0, 1), ArrowRight: () => move(0.15, 0, 1),
        ArrowUp: () => move(0, 0.12, 1), ArrowDown: () => move(0, -0.12, 1),
        "+": () => move(0, 0, 0.85), "=": () => move(0, 0, 0.85), "-": () => move(0, 0, 1 / 0.85),
        Home: () => this.look(this.home),
      };
      if (keys[event.key] && !event.ctrlKey && !event.metaKey && !event.altKey) {
        event.preventDefault();
        keys[event.key]();
      }
    }

    listen() {
      const turned = (event) => {
        if (this.turning) return;
        const key = Object.keys(event || {}).find((name) => /^scene\d*\.camera$/.test(name));
        if (key) this.look(event[key]);
      };
      this.view.on("plotly_relayout", turned);
      // As long as it is on the page.
      const whenThere = (act) => () => { if (this.view.isConnected) act(); };
      document.addEventListener("supple-theme", whenThere(() => { this.describe(); this.draw(); }));
      addEventListener("beforeprint", whenThere(() => this.print(true)));
      addEventListener("afterprint", whenThere(() => this.print(false)));
      new ResizeObserver(() => {
        if (!this.view.clientWidth) return;
        // The robot fills the window as it was when all was drawn.
        const { narrow, aspect } = this.style();
        if (this.narrow !== narrow || Math.abs(this.aspect / aspect - 1) > 0.05) this.draw();
        Plotly.Plots.resize(this.view);
      }).observe(this.view);
      let seen = false;
      new IntersectionObserver((entries) => {
        this.hidden = !entries[entries.length - 1].isIntersecting;
        const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
        if (!this.hidden && !seen && !still) this.play();
        seen = seen || !this.hidden;
      }).observe(this.element);
    }
  }

  /**
   * Puts the view into an element. Returns an object with `play()`, `pause()`, `go(frame)` and `replace(designs)`. Designs may
   * be prepared already, by `SuppleScene.figure.prepare`.
   */
  S.mount = function (element, data, prepared) {
    const view = new View(element, data, prepared);
    if (!view.designs.length) {
      element.textContent = "Nothing to show.";
      return view;
    }
    view.build();
    view.go(0);
    return view;
  };
})((window.SuppleScene = window.SuppleScene || {}));
