"use strict";
// What happens when: moves are asked at once, answers are drawn as they come, slower views follow when sliders rest.
(function (E) {
  const D = E.design;
  const REST = 250, MOST_TIMES = 2000;
  const LOST = "supple has ended or cannot be reached; the dimmed values are outdated. The page continues once the same "
    + "program answers; if you start it again, open the address that it prints.";
  const element = (id) => document.getElementById(id);
  const asked = new Map();
  let rest = 0, latest = 0, ready = false, painting = false, held = null;
  E.times = [];

  /** Asks for the design on screen. */
  function ask() {
    E.motion.wait();
    latest = E.link.ask("evaluate", { values: D.values, task: D.task, want: E.curves.wanted() });
    document.documentElement.dataset.latest = String(latest);
    if (E.moved) {
      asked.set(latest, E.moved);
      E.moved = 0;
      if (asked.size > 200) asked.delete(asked.keys().next().value);
    }
    clearTimeout(rest);
    rest = setTimeout(slower, REST);
  }

  /** What follows when sliders rest. */
  function slower() {
    E.map.ask();
    E.tools.askSensor();
  }

  function askPins() {
    if (!D.pins.length) return;
    const pins = D.pins.map(({ name, values }) => ({ name, values }));
    E.link.ask("pins", { values: D.values, task: D.task, want: E.curves.wanted(), pins });
  }

  function hello(message) {
    const first = !ready;
    D.begin(message);
    document.title = `${message.title || message.file} · supple explore`;
    element("title").textContent = message.title || message.file;
    element("design").disabled = !message.designable;
    element("task").replaceChildren(...D.tasks.map((task, n) => E.make("option", { value: n, selected: n === D.task }, task.name)));
    document.querySelector(".only-several").hidden = D.tasks.length < 2;
    lose(false);
    E.tools.notice("changed", "");
    E.tools.notice("file", message.warnings.slice(0, 3).map((text) => text.replace(/[^.!?]$/, "$&.")).join(" "));
    E.sliders.build();
    E.curves.build();
    if (first) {
      E.map.listen();
      E.tools.listen();
    } else {
      E.motion.clear();
    }
    ready = true;
    E.tools.pinBar();
    E.tools.buttons();
    ask();
    askPins();
    E.map.build();
  }

  /** The design on screen, as far as it can be drawn; a plan that does not converge leaves the last picture. */
  function takeEvaluation(message) {
    if (message.meshes) E.motion.take(message.meshes);
    // While a picture is painted, only the newest answer waits.
    if (painting) {
      held = message;
      return;
    }
    painting = true;
    showEvaluation(message);
    E.painted(() => {
      painting = false;
      const next = held;
      held = null;
      if (next) takeEvaluation({ ...next, meshes: null });
    });
  }

  function showEvaluation(message) {
    if (message.generation !== D.generation) return;
    if (message.error) {
      element("verdict").className = "bad";
      element("verdict").textContent = `This design cannot be evaluated: ${message.error}`;
      stale(true);
      done(message.id, message);
      E.motion.show();
      return;
    }
    if (message.task !== D.task) return;
    const [answer] = message.designs;
    const planned = answer.numbers.planned;
    const keep = !planned && E.now && E.now.numbers.planned !== false;
    E.now = { ...answer, id: message.id, curves: keep ? E.now.curves : answer.curves, scene: keep ? E.now.scene : answer.scene };
    stale(!planned);
    E.numbers.show();
    E.curves.show();
    done(message.id, message);
    E.motion.show();
    E.map.draw();
    if (E.tools.roll.id && E.tools.roll.values !== D.values) E.tools.closeRollouts();
    if (message.id === latest) {
      E.detailsId = E.link.ask("details", { values: message.values, task: D.task });
      E.detailsFor = message.id;
    }
  }

  /** Without the program, nothing on the page follows: it is dimmed, and what would change it does nothing. */
  function lose(is) {
    document.body.classList.toggle("lost", is);
    for (const part of document.querySelectorAll(".bar, #sliders, #map")) part.inert = is;
    if (is) E.tools.endSearch("The search has ended with the connection to supple.");
    E.tools.notice("lost", is ? LOST : "");
  }

  /** Curves and motion may be those of an earlier design. */
  function stale(is) {
    element("still").hidden = !is;
    element("still").textContent = is ? "Curves and motion are those of the last design that could be planned." : "";
    document.body.classList.toggle("stale", is);
  }

  function done(id, message) {
    const began = asked.get(id);
    asked.delete(id);
    const root = document.documentElement;
    if (began) {
      E.times.push({ total: performance.now() - began, computed: message.milliseconds });
      if (E.times.length > MOST_TIMES) E.times.shift();
    }
    root.dataset.shown = String(id);
  }

  function takeDetails(message) {
    if (message.id !== E.detailsId || message.error) return;
    Object.assign(E, { details: message.details, detailsOf: E.detailsFor, detailsValues: message.values });
    document.documentElement.dataset.details = String(E.detailsFor);
    E.numbers.show();
    E.numbers.slopes();
    for (const pin of D.pins) {
      if (pin.values.every((value, n) => value === message.values[n])) pin.details = message.details;
    }
  }

  function takePins(message) {
    if (message.error) {
      E.tools.notice("pins", message.error);
      return;
    }
    if (message.task !== D.task) return;
    E.motion.take(message.meshes);
    for (const answer of message.designs) {
      const pin = D.pins.find((one) => one.name === answer.name);
      if (pin) pin.answer = answer;
    }
    E.numbers.show();
    E.curves.show();
    E.motion.show();
    E.map.draw();
  }

  const TAKE = {
    hello, evaluate: takeEvaluation, details: takeDetails, pins: takePins,
    map: (message) => E.map.take(message), design: (message) => E.tools.takeSearch(message),
    rollouts: (message) => E.tools.takeRollouts(message), save: (message) => E.tools.takeSave(message),
    sensor: (message) => E.tools.takeSensor(message),
    lost: () => lose(true),
    changed: () => E.tools.notice("changed", "The task file was changed.", E.make("button", {
      type: "button",
      onclick: async () => {
        const error = await E.link.reload();
        if (error) E.tools.notice("changed", `The changed task file cannot be read: ${error} The previous version is still shown.`);
      },
    }, "Read it again")),
  };

  E.link.open((message) => {
    if (message.generation !== undefined && message.kind !== "hello" && message.generation !== D.generation) return;
    TAKE[message.kind]?.(message);
  });

  D.onChange((why) => {
    if (why === "move") {
      E.sliders.show();
      E.tools.buttons();
      ask();
      E.map.draw();
    } else if (why === "pins") {
      E.tools.pinBar();
      for (const pin of D.pins) {
        if (!pin.details && E.detailsValues?.every((value, n) => value === pin.values[n])) pin.details = E.details;
      }
      E.numbers.show();
      E.curves.show();
      E.motion.show();
      askPins();
    } else if (why === "want") {
      ask();
      askPins();
    }
  });

  element("task").addEventListener("change", (event) => {
    D.task = Number(event.target.value);
    E.now = null;
    D.pins.forEach((pin) => { pin.answer = null; });
    E.tools.closeRollouts();
    E.motion.clear();
    E.curves.build();
    ask();
    askPins();
  });

  SuppleTheme.onChange(() => {
    document.dispatchEvent(new Event("supple-theme"));
    E.curves.redraw();
    E.map.draw();
    if (!element("rollouts").hidden && E.tools.roll.costs.length) E.tools.histogram();
  });
  // Scripts of the view come last.
  addEventListener("load", () => {
    document.documentElement.dataset.ready = "yes";
    E.motion.show();
  });
})(window.Explore);
