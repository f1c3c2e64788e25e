"use strict";
// A slider with a number beside it for everything that can be turned.
(function (E) {
  const D = E.design, make = E.make;
  const STEPS = 1000;
  const CLOSED = new Set(["Noise"]);
  let rows = [];

  function withUnit(knob, value) {
    return knob.unit ? `${E.number(value)} ${knob.unit}` : E.number(value);
  }

  function row(knob, index) {
    const id = `knob-${index}`;
    const range = make("input", { type: "range", id, min: 0, max: STEPS, step: 1 });
    const text = make("input", {
      type: "text", inputmode: "decimal", size: 9, autocomplete: "off", spellcheck: "false",
      "aria-label": `${knob.name}${knob.unit ? `, ${knob.unit}` : ""}`,
    });
    let moving = false;
    const begin = () => {
      if (!moving) D.keep();
      moving = true;
    };
    range.addEventListener("input", () => {
      begin();
      E.moved = performance.now();
      D.move({ [index]: E.valueAt(knob, range.value / STEPS) });
    });
    range.addEventListener("change", () => { moving = false; });
    text.addEventListener("change", () => {
      const value = Number(text.value.replace(/−/g, "-").replace(",", "."));
      const [low, high] = knob.bounds;
      const good = text.value.trim() !== "" && Number.isFinite(value) && (knob.open || (value >= low && value <= high));
      text.setAttribute("aria-invalid", String(!good));
      if (!good) {
        E.tools.notice("typed", `${knob.name} must be a number${knob.open ? "" : ` from ${E.number(low)} to ${E.number(high)}`}; found ${text.value || "nothing"}`);
        return;
      }
      E.tools.notice("typed", "");
      D.keep();
      E.moved = performance.now();
      D.move({ [index]: value });
    });
    const label = make("label", { for: id, title: knob.about || false }, knob.name,
      knob.unit ? make("span", { class: "unit" }, ` ${knob.unit}`) : null);
    return { knob, index, range, text, element: make("div", { class: "knob" }, label, range, text) };
  }

  /** Makes all sliders. */
  function build() {
    rows = D.knobs.map(row);
    const groups = [...new Set(D.knobs.map((knob) => knob.group))];
    const list = groups.map((group) => {
      const own = rows.filter(({ knob }) => knob.group === group).map(({ element }) => element);
      return make("details", { open: !CLOSED.has(group), class: "group" }, make("summary", {}, group), ...own);
    });
    document.getElementById("sliders").replaceChildren(make("h2", {}, "Design"), ...list);
    show();
  }

  /** Puts every slider to its value. */
  function show() {
    for (const { knob, index, range, text } of rows) {
      const value = D.values[index];
      const share = Math.round(STEPS * Math.min(1, Math.max(0, E.share(knob, value))));
      if (Number(range.value) !== share) range.value = String(share);
      range.setAttribute("aria-valuetext", withUnit(knob, value));
      if (document.activeElement !== text || text.getAttribute("aria-invalid") !== "true") {
        text.value = E.number(value, 5).replace(/−/g, "-");
        text.setAttribute("aria-invalid", "false");
      }
    }
  }

  E.sliders = { build, show, withUnit };
})(window.Explore);
