"use strict";
// The numbers of the design on screen, and of pinned ones: information, cost by part, sensitivities.
(function (E) {
  const D = E.design, make = E.make, number = (value, digits) => E.number(value, digits);
  const PARTS = [["nominal", "plan"], ["belief", "estimation error"], ["process", "process noise"], ["initial", "initial uncertainty"]];
  const MOST_SLOPES = 12;

  /** All designs that are compared: the one on screen first. */
  function designs() {
    const now = E.now ? [{ name: "now", numbers: E.now.numbers, details: E.details, dated: E.detailsOf !== E.now.id }] : [];
    return now.concat(D.pins.filter((pin) => pin.answer)
      .map((pin) => ({ name: pin.name, numbers: pin.answer.numbers, details: pin.details })));
  }

  function percent(share) {
    return `${number(100 * Math.abs(share), 3)} %`;
  }

  /** Whether the design meets its limits, and by how much. */
  function verdict(numbers) {
    const several = numbers.tasks.length > 1;
    const of = (task) => (several ? ` of ${task.name}` : "");
    const lost = numbers.tasks.filter((task) => !task.converged);
    if (lost.length) return ["bad", lost.map((task) => `The plan${of(task)} did not converge (${task.status}).`).join(" ")];
    const limited = numbers.tasks.filter((task) => task.excess !== null);
    const text = limited.map((task) => {
      if (Math.abs(task.excess) <= D.feasibility) return `cost${of(task)} is at its limit ${number(task.bound)}`;
      const way = task.excess > 0 ? "above" : "below";
      const by = task.bound === 0 ? "" : `${percent(task.excess)} `;
      return `cost${of(task)} ${number(task.expected)} is ${by}${way} its limit ${number(task.bound)}`;
    }).join("; ");
    if (numbers.feasible) return ["good", text ? `Feasible: ${text}.` : "Feasible: there is no cost limit."];
    const budget = numbers.budget !== null && numbers.price > numbers.budget ? ` The price ${number(numbers.price)} exceeds the budget ${number(numbers.budget)}.` : "";
    return ["bad", `Not feasible: ${text || "a number is not finite"}.${budget}`];
  }

  function bar(value, most, kind) {
    const width = Number.isFinite(value) && most > 0 ? Math.min(100, (100 * Math.abs(value)) / most) : 0;
    return make("span", { class: `bar-cell ${kind}`, "aria-hidden": "true" }, make("span", { style: `width:${width}%` }));
  }

  /** The sum of a number over the tasks, with their weights; nothing where a task lacks it. */
  function weighted(details, key) {
    const list = details?.tasks.map((task, n) => (task[key] === null || task[key] === undefined ? NaN : D.tasks[n].weight * task[key]));
    const sum = list?.reduce((a, b) => a + b, 0);
    return Number.isFinite(sum) ? sum : null;
  }

  function informations(list) {
    const rows = [
      ["needed", "by any sensors and any controller", (one) => weighted(one.details, "needed"), true],
      ["used", "by the controller", (one) => one.numbers.used],
      ["measured", "by the sensors", (one) => one.numbers.measured],
    ];
    const most = Math.max(...list.flatMap((one) => rows.map(([, , of]) => of(one) ?? 0)));
    const long = E.details?.tasks.some((task) => task.needed_takes_long);
    const body = rows.map(([name, about, of, late]) => make("tr", {},
      make("th", { scope: "row" }, name, make("span", { class: "note" }, ` ${about}`)),
      ...list.map((one) => {
        const value = of(one);
        const text = value === null && late && long && one.name === "now" ? "takes long" : number(value);
        return make("td", { class: one.dated && late ? "number dated" : "number" }, text, bar(value, most, name));
      })));
    const all = D.tasks.length > 1 ? "Information of all tasks, bits" : "Information, bits";
    const weights = D.tasks.some((task) => task.weight !== 1) ? ", weighted by information_weight" : "";
    return table(all + weights, ["", ...list.map((one) => one.name)], body);
  }

  function costs(list) {
    return D.tasks.map((about, n) => {
      const of = (one) => one.numbers.tasks[n];
      const most = Math.max(...list.map((one) => Math.max(of(one).expected, of(one).bound ?? 0)));
      const strip = (task) => {
        const share = (value) => `${Math.max(0, Math.min(100, (100 * value) / most))}%`;
        const parts = PARTS.map(([key]) => make("span", { class: `part ${key}`, style: `width:${share(task.parts[key])}` }));
        const limit = task.bound === null ? null : make("span", { class: "limit", style: `left:${share(task.bound)}` });
        return make("span", { class: "strip", "aria-hidden": "true" }, ...parts, limit);
      };
      const line = (name, pick, kind) => make("tr", {}, make("th", { scope: "row" },
        kind ? make("span", { class: `swatch part ${kind}`, "aria-hidden": "true" }) : null, name),
        ...list.map((one) => make("td", { class: "number" }, number(pick(of(one))))));
      const body = [
        make("tr", {}, make("th", { scope: "row" }, "expected cost"),
          ...list.map((one) => make("td", { class: "number" }, number(of(one).expected), strip(of(one))))),
        ...PARTS.map(([key, name]) => line(name, (task) => task.parts[key], key)),
        line("limit", (task) => task.bound),
      ];
      return table(D.tasks.length > 1 ? `Cost of ${about.name}` : "Cost", ["", ...list.map((one) => one.name)], body);
    });
  }

  function table(caption, head, body) {
    return make("div", { class: "table", tabindex: 0, role: "region", "aria-label": caption },
      make("table", {}, make("caption", {}, caption),
        make("thead", {}, make("tr", {}, ...head.map((text, n) => make("th", { scope: "col", class: n ? "number" : false }, text)))),
        make("tbody", {}, ...body)));
  }

  function contacts(task) {
    return task.contacts.map((contact) => (contact.touches
      ? `${contact.name}: touches from ${number(contact.first_s, 3)} to ${number(contact.last_s, 3)} s, up to ${number(contact.peak_force_N, 3)} N.`
      : `${contact.name}: never touches; clearance at least ${number(contact.least_clearance_m, 3)} m.`)).join(" ");
  }

  /** Shows the numbers of the design on screen and of pins. */
  function show() {
    const list = designs();
    if (!list.length) return;
    const now = E.now?.numbers;
    const current = E.details && E.now && E.detailsOf === E.now.id;
    const text = document.getElementById("verdict");
    if (now) {
      let [kind, said] = verdict(now);
      // What roll-outs say comes later than the other numbers.
      if (current && E.details.tasks.some((task) => task.broken)) {
        [kind, said] = ["bad", `${said} But roll-outs contradict the plan: do not use these numbers.`];
      }
      text.className = kind;
      if (text.textContent !== said) text.textContent = said;
    }
    const notes = [];
    const task = now?.tasks[D.task];
    if (task?.contacts.length) notes.push(make("p", { class: "note" }, contacts(task)));
    const warnings = now ? [...new Set(now.tasks.flatMap((one) => one.warnings))] : [];
    warnings.forEach((warning) => notes.push(make("p", { class: "warning" }, warning)));
    if (current) {
      E.details.tasks.forEach((one, n) => {
        const of = D.tasks.length > 1 ? ` of ${D.tasks[n].name}` : "";
        if (one.rollouts) notes.push(make("p", { class: one.broken ? "warning bad" : "warning" }, `Roll-outs${of}: ${one.rollouts}.`));
      });
    }
    document.getElementById("tables").replaceChildren(informations(list), ...costs(list), ...notes);
  }

  /** Shows how information and cost change with each parameter. */
  function slopes() {
    const place = document.getElementById("slopes"), details = E.details;
    if (!details) return;
    const tasks = details.tasks.filter((task) => task.information_slopes);
    if (!tasks.length || !details.parameters.length) {
      place.replaceChildren(make("p", { class: "note" }, details.parameters.length ? "This kind of plan has no gradients." : "The task has no parameters."));
      return;
    }
    const at = E.detailsValues;
    const rows = details.parameters.map((name, n) => {
      const sum = (key) => details.tasks.reduce((all, task, t) => all + (key === "cost_slopes" ? (t === D.task ? 1 : 0) : D.tasks[t].weight) * (task[key]?.[n] ?? NaN), 0);
      return { name, bits: 0.01 * at[n] * sum("information_slopes"), cost: 0.01 * at[n] * sum("cost_slopes") };
    });
    rows.sort((a, b) => Math.abs(b.bits) - Math.abs(a.bits));
    const most = (key) => Math.max(...rows.map((row) => Math.abs(row[key])).filter(Number.isFinite), 0);
    const cell = (row, key) => make("td", { class: "number" }, `${row[key] > 0 ? "+" : ""}${number(row[key], 3)}`,
      bar(row[key], most(key), row[key] > 0 ? "up" : "down"));
    const body = rows.slice(0, MOST_SLOPES).map((row) =>
      make("tr", {}, make("th", { scope: "row" }, row.name), cell(row, "bits"), cell(row, "cost")));
    const rest = rows.length > MOST_SLOPES ? ` The ${MOST_SLOPES} greatest of ${rows.length} are shown.` : "";
    const price = details.price_bits_per_cost;
    const said = price === null ? "" : price > 0
      ? `+1 in cost saves about ${number(price, 3)} bits (shadow price by least squares, exact at an optimum whose only active limit is this one).`
      : "Cost and information can both be reduced here; there is no trade-off.";
    const invalid = details.tasks.some((task) => task.valid === false) ? " The plan is not stationary enough for gradients to hold." : "";
    place.replaceChildren(table("Change when a parameter increases by 1 %", ["parameter", D.tasks.length > 1 ? "bits of all tasks" : "bits", D.tasks.length > 1 ? `cost of ${D.tasks[D.task].name}` : "cost"], body),
      make("p", { class: "note" }, said + rest + invalid));
  }

  E.numbers = { show, slopes, verdict };
})(window.Explore);
