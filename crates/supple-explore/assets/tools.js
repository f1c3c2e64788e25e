"use strict";
// Searches, roll-outs, pins, files, and what there is to say.
(function (E) {
  const D = E.design, make = E.make, number = (value, digits) => E.number(value, digits);
  const element = (id) => document.getElementById(id);
  const search = { id: 0, running: false, stopping: false, found: null }, roll = { id: 0, costs: [], lost: 0 }, sensor = { id: 0 };
  const ENDED = {
    converged: "converged", not_optimal: "stopped where the total gradient is not zero", not_converged: "did not converge",
    bound_violated: "found no design that meets every limit", stopped: "was stopped",
  };

  /** A message of a kind, in place of the one before; an empty one removes it. */
  function notice(kind, text, ...actions) {
    const place = element("notices");
    place.querySelector(`[data-kind="${kind}"]`)?.remove();
    if (!text) return;
    const close = make("button", { type: "button", "aria-label": "Close this message", onclick: () => notice(kind, "") }, "×");
    place.append(make("p", { "data-kind": kind, class: "notice" }, `${text} `, ...actions, close));
  }

  // The search.
  function startSearch() {
    D.keep();
    Object.assign(search, { running: true, stopping: false, found: null });
    element("search").hidden = false;
    element("search-load").hidden = true;
    element("search-progress").hidden = element("search-stop").hidden = false;
    element("search-text").textContent = "Evaluating the design on screen, where the search starts.";
    E.map.state.path = [];
    search.id = E.link.ask("design", { values: D.values, count: 1 });
  }

  /** Nothing is searched for any more; where that needs a reason, it is said. */
  function endSearch(why) {
    if (why && search.running) element("search-text").textContent = why;
    search.running = false;
    element("search-progress").hidden = element("search-stop").hidden = true;
  }

  function stopSearch() {
    search.stopping = true;
    element("search-text").textContent = "Stopping.";
    E.link.ask("stop", { what: "design" });
  }

  function takeSearch(message) {
    if (message.id !== search.id) return;
    const text = element("search-text");
    if (message.error) {
      endSearch();
      const why = message.error.startsWith("stopped") ? "The search was" : "The search cannot run:";
      text.textContent = `${why} ${message.error}.`.replace(/\.\.$/, ".");
    } else if (message.visited) {
      const { evaluations, bits, violation, phase } = message.visited;
      const way = violation > D.feasibility ? `${number(100 * violation, 3)} % above a limit` : "within every limit";
      const now = phase === "searching" ? "" : ` Now ${phase}.`;
      if (!search.stopping) text.textContent = `${evaluations} designs evaluated; the last one: ${number(bits)} bits, ${way}.${now}`;
      E.map.visited(message.visited.design);
    } else {
      endSearch();
      const end = message.ended;
      const price = end.prices.filter((one) => one.bits_per_unit > 0)
        .map((one) => ` Limit${D.tasks.length > 1 ? ` of ${one.task}` : ""} active: +1 in cost saves ${number(one.bits_per_unit, 3)} bits.`).join("");
      const errors = end.errors.length ? ` ${end.errors.join(" ")}` : "";
      text.textContent = `The search ${ENDED[end.status] ?? end.status} after ${end.evaluations} designs and ${number(end.seconds, 3)} s: ${number(end.from_bits)} → ${number(end.to_bits)} bits.${price}${errors}`;
      search.found = message.design;
      // What was found comes on screen; undo returns to where it began.
      D.load(message.design);
      buttons();
    }
  }

  // Roll-outs.
  function startRollouts() {
    Object.assign(roll, { costs: [], lost: 0 });
    element("rollouts").hidden = false;
    element("rollouts-note").textContent = "Roll-outs are running.";
    E.curves.setThreads(null);
    roll.values = D.values;
    roll.id = E.link.ask("rollouts", { values: D.values, task: D.task, count: 50, want: E.curves.wanted() });
  }

  function takeRollouts(message) {
    if (message.id !== roll.id) return;
    if (message.error) {
      element("rollouts-note").textContent = `No roll-outs: ${message.error}`;
      return;
    }
    roll.costs.push(...message.costs.filter((cost) => cost !== null));
    roll.lost += message.costs.filter((cost) => cost === null).length;
    roll.of = message.count;
    E.curves.setThreads(message);
    histogram();
  }

  function closeRollouts() {
    if (element("rollouts").hidden) return;
    element("rollouts").hidden = true;
    roll.id = 0;
    E.link.ask("stop", { what: "rollouts" });
    E.curves.setThreads(null);
  }

  function histogram() {
    const canvas = element("histogram"), { costs } = roll;
    const scale = Math.min(2, window.devicePixelRatio || 1), width = canvas.clientWidth || 300, height = Math.round(150 * E.larger());
    Object.assign(canvas, { width: width * scale, height: height * scale });
    canvas.style.height = `${height}px`;
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.scale(scale, scale);
    const sorted = costs.slice().sort((a, b) => a - b), mean = costs.reduce((a, b) => a + b, 0) / costs.length;
    const task = E.now?.numbers.tasks[D.task];
    // A few very expensive runs do not flatten the rest: they count in the last bar.
    const low = sorted[0], high = sorted[Math.ceil(0.95 * (sorted.length - 1))], count = 16, room = height - 30;
    const bins = Array(count).fill(0);
    costs.forEach((cost) => { bins[Math.min(count - 1, Math.max(0, Math.floor(((cost - low) / (high - low || 1)) * count)))] += 1; });
    const most = Math.max(...bins, 1), across = (cost) => 8 + ((cost - low) / (high - low || 1)) * (width - 16);
    context.fillStyle = SuppleTheme.colour("@1");
    bins.forEach((n, b) => context.fillRect(8 + (b * (width - 16)) / count, 4 + room * (1 - n / most), (width - 16) / count - 1, (room * n) / most));
    const mark = (cost, colour, dash) => {
      if (cost === null || cost === undefined || !(cost >= low && cost <= high)) return;
      context.strokeStyle = SuppleTheme.colour(colour);
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(across(cost), 0);
      context.lineTo(across(cost), room + 4);
      context.stroke();
    };
    context.lineWidth = 2;
    mark(task?.expected, "@2", []);
    mark(task?.bound, "@ink", [5, 3]);
    context.fillStyle = SuppleTheme.colour("@ink");
    context.font = `${11 * E.larger()}px system-ui, sans-serif`;
    context.fillText(number(low, 3), 8, height - 8);
    context.textAlign = "right";
    context.fillText(sorted[sorted.length - 1] > high ? `≥ ${number(high, 3)}` : number(high, 3), width - 8, height - 8);
    const lost = roll.lost ? ` ${roll.lost} diverged.` : "";
    const note = `${costs.length} of ${roll.of} roll-outs: cost from ${number(low)} to ${number(sorted[sorted.length - 1])}, mean ${number(mean)}; expected ${number(task?.expected)} (line), limit ${number(task?.bound)} (dashed).${lost} Grey threads show them over time.`;
    element("rollouts-note").textContent = note;
    canvas.setAttribute("aria-label", `Histogram of costs. ${note}`);
  }

  // Pins.
  function pin() {
    if (D.pin() === null) notice("pins", "Three designs are pinned already: remove one of them first.");
  }

  function pinBar() {
    document.querySelectorAll(".pin").forEach((one) => one.remove());
    const bar = element("pin").parentElement;
    D.pins.forEach(({ name, values }) => bar.insertBefore(make("span", { class: "pin", "data-pin": name },
      make("button", { type: "button", "aria-label": `Show design ${name}`, onclick: () => D.load(values) }, name),
      make("button", { type: "button", "aria-label": `Remove design ${name}`, onclick: () => D.unpin(name) }, "×")), element("design")));
  }

  // Files.
  function save(what) {
    if (!what) return;
    notice("saved", what === "set" ? "" : "Saving.");
    E.link.ask("save", { values: D.values, what });
  }

  function takeSave(message) {
    if (message.error) {
      notice("saved", `Not saved: ${message.error}`);
    } else if (message.what === "set") {
      const text = message.text || "(all parameters are at their initial values)";
      notice("saved", "", );
      notice("saved", "Options of supple for this design:", make("code", { tabindex: 0 }, text));
      if (message.text) navigator.clipboard?.writeText(message.text).catch(() => {});
    } else {
      notice("saved", `Saved: ${message.path}`);
    }
  }

  // The virtual sensor.
  function askSensor() {
    if (!element("sensor-open").open) return;
    const details = E.details?.tasks[D.task];
    if (details?.needed_takes_long) {
      element("sensor-text").textContent = "With this many states the minimum takes long to compute; use `supple bound`.";
      return;
    }
    sensor.id = E.link.ask("sensor", { values: D.values, task: D.task });
    element("sensor-text").classList.add("dated");
  }

  function takeSensor(message) {
    if (message.id !== sensor.id) return;
    const place = element("sensor-text");
    place.classList.remove("dated");
    if (message.error || !message.sensor) {
      place.textContent = `No sensor was found: ${message.error ?? "there is none"}`;
      return;
    }
    const { bits, cost, measured, windows } = message.sensor;
    const list = windows.map((window) => make("li", {}, `${number(window.from, 3)} to ${number(window.until, 3)} s, ${number(window.bits, 3)} bits: `,
      window.directions.slice(0, 3).map((one) => one.text).join("; ") || "nothing"));
    const states = measured.filter((one) => one.bits > 0.01 * bits).sort((a, b) => b.bits - a.bits)
      .map((one) => `${one.state} ${number(one.bits, 3)}`).join(", ");
    place.replaceChildren(make("p", {}, `${number(bits)} bits suffice for an expected cost of ${number(cost)}.`),
      make("p", {}, `Bits by state: ${states || "none"}.`), make("ul", {}, ...list));
  }

  function listen() {
    element("undo").addEventListener("click", D.undo);
    element("redo").addEventListener("click", D.redo);
    element("reset").addEventListener("click", () => D.load(D.knobs.map((knob) => knob.start)));
    element("pin").addEventListener("click", pin);
    element("design").addEventListener("click", startSearch);
    element("search-stop").addEventListener("click", stopSearch);
    element("search-load").addEventListener("click", () => search.found && D.load(search.found));
    element("roll").addEventListener("click", startRollouts);
    element("rollouts-close").addEventListener("click", closeRollouts);
    element("save").addEventListener("change", (event) => { save(event.target.value); event.target.value = ""; });
    element("sensor-open").addEventListener("toggle", askSensor);
    element("curve-add").addEventListener("change", (event) => { if (event.target.value) { E.curves.add(event.target.value); D.tell("want"); } });
    document.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.target.matches("input[type=text]")) return;
      const key = event.key.toLowerCase();
      if (key === "z" || key === "y") event.preventDefault();
      if (key === "y" || (key === "z" && event.shiftKey)) D.redo();
      else if (key === "z") D.undo();
    });
  }

  function buttons() {
    element("undo").disabled = !D.done.some((values) => values.some((value, n) => value !== D.values[n]));
    element("redo").disabled = !D.undone.length;
    const shown = search.found?.every((value, n) => value === D.values[n]);
    element("search-load").hidden = search.running || !search.found || shown;
  }

  E.tools = {
    notice, listen, buttons, pinBar, endSearch, takeSearch, takeRollouts, takeSave, takeSensor, askSensor, closeRollouts, histogram,
    search, roll,
  };
})(window.Explore);
