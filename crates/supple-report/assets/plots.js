"use strict";
// Draws the page's plots with plotly.js: unpacks their numbers, puts colours and views in their place.
const supplePlots = (data) => {
  const unpacked = new Map();
  const PRINT_WIDTH = 670;
  const NARROW = 500;

  // How many times as large as on a screen of usual size texts are; printed pages are of usual size.
  function larger(printing) {
    return printing ? 1 : (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
  }

  function bytes(text) {
    const raw = atob(text);
    const out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i += 1) out[i] = raw.charCodeAt(i);
    return new DataView(out.buffer);
  }

  // A curve in steps of its range: differences, in groups of 7 bits; 0 where there is no number.
  function curve({ from, step, c }) {
    const view = bytes(c);
    const out = [];
    let number = 0, shift = 0, level = 0;
    for (let i = 0; i < view.byteLength; i += 1) {
      const byte = view.getUint8(i);
      number |= (byte & 127) << shift;
      shift += 7;
      if (byte > 127) continue;
      level += number % 2 === 0 ? number >> 1 : -(number >> 1);
      out.push(number === 0 ? null : from + step * level);
      number = shift = 0;
    }
    return out;
  }

  // The numbers of an array of the page; rows of numbers for a grid.
  function unpack(index) {
    if (unpacked.has(index)) return unpacked.get(index);
    const packed = data.arrays[index];
    let out;
    if (packed.c !== undefined) {
      out = curve(packed);
    } else if (packed.f8 !== undefined) {
      const view = bytes(packed.f8);
      out = Array.from({ length: view.byteLength / 8 }, (_, i) => finite(view.getFloat64(8 * i, true)));
    } else {
      const view = bytes(packed.f4);
      const columns = packed.columns;
      out = Array.from({ length: view.byteLength / 4 / columns }, (_, row) =>
        Array.from({ length: columns }, (__, column) => finite(view.getFloat32(4 * (row * columns + column), true))));
    }
    unpacked.set(index, out);
    return out;
  }

  function finite(value) {
    return Number.isFinite(value) ? value : null;
  }

  // An array of the page, or one plus a multiple of another.
  function numbers(reference) {
    const base = unpack(reference.a);
    if (reference.add === undefined) return base;
    const other = unpack(reference.add);
    return base.map((value, i) => (value === null || other[i] === null ? null : value + reference.times * other[i]));
  }

  // Text in which plotly.js finds no markup but line breaks.
  function plain(text) {
    return text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/\n/g, "<br>");
  }

  const COLOURS = new Set(["color", "fillcolor", "bgcolor"]);
  const TEXTS = new Set(["name", "text", "legendgroup"]);

  // What plotly.js takes, of what the page holds.
  function resolve(value, key) {
    if (typeof value === "string") {
      if (COLOURS.has(key)) return SuppleTheme.colour(value);
      return TEXTS.has(key) || key === "item" ? plain(value) : value;
    }
    if (Array.isArray(value)) return value.map((item) => resolve(item, COLOURS.has(key) ? key : "item"));
    if (value === null || typeof value !== "object") return value;
    if (value.a !== undefined) return numbers(value);
    return Object.fromEntries(Object.entries(value).map(([name, item]) => [name, resolve(item, name)]));
  }

  function setPath(target, path, value) {
    const keys = path.split(".");
    const last = keys.pop();
    let at = target;
    for (const key of keys) at = at[key] ??= {};
    at[last] = value;
  }

  function axis(own) {
    const colour = SuppleTheme.colour;
    return {
      automargin: true, gridcolor: colour("@faint"), linecolor: colour("@ink/0.5"), zerolinecolor: colour("@ink/0.4"),
      tickangle: 0, exponentformat: "power", ...(own.type === "log" ? { tickformat: "~g" } : {}), ...own, title: { standoff: 8, ...(own.title ?? {}) },
    };
  }

  function layoutOf(plot, view, width, height, size, tools) {
    const own = resolve(plot.layout, "");
    for (const [path, value] of Object.entries(view?.layout ?? {})) setPath(own, path, typeof value === "string" ? plain(value) : value);
    const colour = SuppleTheme.colour;
    const layout = {
      autosize: true, hovermode: "x unified", height,
      font: { family: "system-ui, sans-serif", size: size * (width < NARROW ? 11 : 13), color: colour("@ink") },
      paper_bgcolor: colour("@paper"), plot_bgcolor: colour("@paper"),
      margin: { l: size * (width < NARROW ? 44 : 64), r: tools ? 38 : 12, t: 12, b: 44 * size },
      modebar: { orientation: "v" },
      legend: { orientation: "h", x: 0, y: 1.01, xanchor: "left", yanchor: "bottom" },
      hoverlabel: { bgcolor: colour("@paper"), font: { color: colour("@ink") } },
      ...own,
    };
    for (const key of Object.keys(layout).filter((name) => /^[xy]axis\d*$/.test(name))) {
      layout[key] = axis(layout[key]);
      // Logarithmic ticks at 1, 2 and 5 of a decade at most, as the texts of all nine would touch.
      if (key.startsWith("x") && layout[key].type === "log" && layout[key].tickvals === undefined) layout[key].nticks ??= 3;
      const { title, domain = [0, 1] } = layout[key];
      if (key.startsWith("y") && title.text) {
        // No longer than the axis is high.
        const room = (domain[1] - domain[0]) * (plot.height - 56) / (width < NARROW ? 6 : 7.2);
        title.text = broken(title.text, Math.max(12, Math.floor(room)));
      }
      if (layout[key].type === "category") {
        layout[key].dtick = 1;
        continue;
      }
      // Few ticks on narrow screens, so that their texts do not touch.
      if (width < NARROW && layout[key].tickvals === undefined) layout[key].nticks ??= key.startsWith("x") ? 5 : 6;
    }
    layout.xaxis ??= axis({});
    layout.yaxis ??= axis({});
    if (layout.scene) {
      for (const key of ["xaxis", "yaxis", "zaxis"]) {
        layout.scene[key] = { ...axis(layout.scene[key]), automargin: undefined, backgroundcolor: colour("@paper") };
      }
      layout.scene.camera = { eye: { x: -1.5, y: -1.5, z: 0.9 } };
    }
    return layout;
  }

  function tracesOf(plot, view) {
    const indices = view ? view.traces : plot.traces.map((_, i) => i);
    return indices.map((index, place) => {
      const trace = resolve(plot.traces[index], "");
      if (view?.y) trace.y = resolve(view.y[place], "y");
      return trace;
    });
  }

  // Bars side by side become bars below one another where their names would touch.
  function lay(traces, layout, width, height, size) {
    const names = traces[0]?.x ?? [];
    const longest = Math.max(0, ...names.map((name) => String(name).length)) * size * (width < NARROW ? 6.4 : 7.6) + 12;
    if (layout.xaxis.type !== "category" || names.length * longest < width - 100 * size) return height;
    for (const trace of traces) [trace.x, trace.y, trace.orientation] = [trace.y, trace.x, "h"];
    [layout.xaxis, layout.yaxis] = [{ ...layout.yaxis, nticks: 4 }, { ...layout.xaxis, autorange: "reversed" }];
    layout.hovermode = "y unified";
    return Math.max(height, Math.round(size * (120 + names.length * Math.max(24, 12 * traces.length))));
  }

  // A text in lines of at most so many letters, as far as it has spaces.
  function broken(text, most) {
    const lines = [""];
    for (const word of text.split(" ")) {
      const last = lines[lines.length - 1];
      if (!last) lines[lines.length - 1] = word;
      else if (last.length + 1 + word.length <= most) lines[lines.length - 1] = `${last} ${word}`;
      else lines.push(word);
    }
    return lines.join("<br>");
  }

  // Height that the legend takes above the plot.
  function legendHeight(traces, width, size) {
    const names = new Map();
    for (const trace of traces) if (trace.showlegend !== false) names.set(trace.legendgroup ?? trace.name, trace.name);
    if (names.size < 2 && !traces.some((trace) => trace.showlegend === true)) return 0;
    const lines = [...names.values()].map((name) => name.split("<br>"));
    const longest = Math.max(0, ...lines.flat().map((line) => line.length)) * size * (width < NARROW ? 6 : 7.2) + 48;
    const tallest = Math.max(1, ...lines.map((parts) => parts.length));
    return 21 * size * (0.3 + 0.7 * tallest) * Math.ceil(names.size / Math.max(1, Math.floor((width - 60) / longest)));
  }

  class Figure {
    constructor(element) {
      this.element = element;
      this.plot = data.plots[Number(element.dataset.plot)];
      this.canvas = element.querySelector(".canvas");
      this.select = element.querySelector("select");
      this.drawn = false;
      this.select?.addEventListener("change", () => this.draw());
      for (const button of element.querySelectorAll("button[data-save]")) {
        button.addEventListener("click", () => this.save(button.dataset.save));
      }
    }

    view(printing) {
      const flat = printing && this.plot.views?.some((view) => view.name === "Surface");
      return this.plot.views?.[flat ? 0 : Number(this.select?.value ?? 0)];
    }

    draw(printing = false) {
      const view = this.view(printing);
      const width = printing ? PRINT_WIDTH : this.canvas.clientWidth;
      const traces = tracesOf(this.plot, view);
      const size = larger(printing);
      // Names of the legend are no wider than the plot.
      const most = Math.floor((width - 100 * size) / (size * (width < NARROW ? 6 : 7.2)));
      for (const trace of traces) if (trace.name) trace.name = broken(trace.name, Math.max(12, most));
      let height = Math.round(this.plot.height * size + legendHeight(traces, width, size));
      // The tools are beside the plot, where they cover no entry of the legend.
      const hidden = printing || width < NARROW;
      const layout = layoutOf(this.plot, view, width, height, size, !hidden);
      layout.height = height = lay(traces, layout, width, height, size);
      if (printing) Object.assign(layout, { autosize: false, width });
      this.canvas.style.height = `${height}px`;
      this.canvas.setAttribute("aria-label", view?.alternative ?? this.canvas.getAttribute("aria-label"));
      // plotly.js fails where it shall draw contours again that have not changed.
      if (this.drawn && this.plot.traces.some((trace) => trace.type === "contour")) Plotly.purge(this.canvas);
      this.drawn = true;
      return Plotly.react(this.canvas, traces, layout, {
        responsive: !printing, displaylogo: false, displayModeBar: hidden ? false : "hover",
        modeBarButtonsToRemove: ["select2d", "lasso2d", "toImage"],
      });
    }

    async save(format) {
      if (!this.drawn) await this.draw();
      const name = this.plot.title.replace(/[^\p{L}\p{N}]+/gu, "_").replace(/^_|_$/g, "").toLowerCase();
      if (format === "svg") {
        const { width, height } = this.canvas.getBoundingClientRect();
        await Plotly.downloadImage(this.canvas, { format: "svg", filename: name, width, height });
        return;
      }
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([table(this.plot, this.view(false))], { type: "text/csv" }));
      link.download = `${name}.csv`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }
  }

  // The numbers of a view as they are drawn, in long form: trace, x, y and, of surfaces and contours, z.
  function table(plot, view) {
    const quote = (value) => (typeof value === "string" ? `"${value.replace(/"/g, '""')}"` : String(value ?? ""));
    const rows = [["trace", "x", "y", "z"]];
    const indices = view ? view.traces : plot.traces.map((_, i) => i);
    const plainArray = (value) => (value?.a !== undefined ? numbers(value) : (value ?? []));
    indices.forEach((index, place) => {
      const trace = plot.traces[index];
      const [x, y, z] = [trace.x, view?.y ? view.y[place] : trace.y, trace.z].map(plainArray);
      if (Array.isArray(z[0])) {
        z.forEach((line, r) => line.forEach((value, c) => rows.push([trace.name, x[c], y[r], value])));
      } else {
        y.forEach((value, i) => rows.push([trace.name, x[i], value, z[i]]));
      }
    });
    return rows.map((row) => row.map(quote).join(",")).join("\n") + "\n";
  }

  return [...document.querySelectorAll("figure.plot")].map((element) => new Figure(element));
};
