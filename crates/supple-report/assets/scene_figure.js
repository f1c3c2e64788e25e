// What plotly draws: traces of each design at each frame, their scales, ranges and layout.
(function (S) {
  "use strict";
  const G = S.geometry;

  // Okabe and Ito: to be told apart by all. Those of the page's plots, which are lighter where the paper is dark.
  const COLOURS = ["#0072b2", "#c98500", "#009e73", "#b0558c", "#3d9bd1", "#d55e00"];
  const LIGHTER = ["#56b4e9", "#f2b632", "#2bc49a", "#e3a3c8", "#a9d8f5", "#f0803c"];
  const KINDS = ["bodies", "walls", "edges", "bands", "springs", "pulls", "forces", "torques", "beliefs"];

  /** Colours of what all designs share. */
  function palette(dark) {
    return dark
      ? { fixed: "#c3c7ce", wall: "#9aa0aa", force: "#ff6b60", spring: "#e8e6e1", torque: "#c5a3f0" }
      : { fixed: "#565b64", wall: "#7a7f88", force: "#d62728", spring: "#1b1b1b", torque: "#7d4fb5" };
  }

  /** The colour of a design. */
  function colour(index, dark) {
    const list = dark ? LIGHTER : COLOURS;
    return list[index % list.length];
  }

  function mix(colour, other, share) {
    const parts = (text) => [1, 3, 5].map((n) => parseInt(text.slice(n, n + 2), 16));
    const [a, b] = [parts(colour), parts(other)];
    return "#" + a.map((v, n) => Math.round(v + share * (b[n] - v)).toString(16).padStart(2, "0")).join("");
  }

  /**
   * A design with its surfaces decoded and all that does not change put together; taken over from another design, where
   * one with the same surfaces is given.
   */
  function prepare(design, meshes, index, before) {
    const bodies = design.bodies.filter((body) => body.mesh !== null);
    const surfaces = bodies.map((body) => meshes[body.mesh]);
    const ball = G.ball(14, 8), cube = G.cube();
    const shared = before && before.index === index && before.surfaces.length === surfaces.length
      && surfaces.every((surface, n) => surface === before.surfaces[n]);
    if (shared) {
      const { model } = before;
      const plates = before.walls.length === design.walls.length ? before.plates : G.merge(design.walls.map(() => cube));
      const balls = before.beliefs.length === design.beliefs.length ? before.balls : G.merge(design.beliefs.map(() => ball));
      return { ...design, bodies, surfaces, model, index, ball, cube, plates, balls };
    }
    return {
      ...design, bodies, surfaces, model: G.merge(surfaces), index, ball, cube,
      plates: G.merge(design.walls.map(() => cube)),
      balls: G.merge(design.beliefs.map(() => ball)),
    };
  }

  function moves(body) {
    return body.position.length > 1 || body.rotation.length > 1;
  }

  /** The colour of each triangle: neighbours of a design in two shades, what stands still in grey. */
  function tints(design, dark) {
    const own = colour(design.index, dark), other = mix(own, "#000000", 0.25);
    const of = design.bodies.map((body, n) => (!moves(body) ? palette(dark).fixed : n % 2 ? other : own));
    return design.model.of.map((n) => of[n]);
  }

  function bodies(design, frame) {
    const out = G.coordinates(design.model.count);
    design.bodies.forEach((body, n) => {
      const first = design.model.firsts[n];
      G.place(design.surfaces[n].vertices, G.at(body.position, frame), G.at(body.rotation, frame), out, first);
    });
    return out;
  }

  /** Plates of walls: with `spread`, the band of two standard deviations about each, that many times as large. */
  function walls(design, frame, spread) {
    const out = G.coordinates(design.plates.count);
    design.walls.forEach((wall, n) => {
      const band = spread * 4 * G.at(wall.deviation, frame);
      const [a, b, thick] = spread ? [wall.size[0], wall.size[1], band] : wall.size;
      const vertices = design.cube.vertices.map((v, m) => {
        if (m % 3 === 2) return spread ? v * thick : (v - 0.5) * thick;
        return v * (m % 3 === 0 ? a : b);
      });
      G.place(vertices, G.at(wall.position, frame), wall.rotation, out, design.plates.firsts[n]);
    });
    return out;
  }

  /** The edges of the plates of walls. */
  function edges(design, frame) {
    const { x, y, z } = walls(design, frame, 0), lines = new G.Lines();
    design.walls.forEach((_, n) => {
      const corner = (m) => [x, y, z].map((list) => list[design.plates.firsts[n] + m]);
      for (const ring of [[0, 1, 3, 2, 0], [4, 5, 7, 6, 4], [0, 4], [1, 5], [2, 6], [3, 7]]) lines.line(ring.map(corner));
    });
    return lines;
  }

  function beliefs(design, frame, factor) {
    const out = G.coordinates(design.balls.count);
    design.beliefs.forEach((belief, n) => {
      const [px, py, pz] = G.at(belief.position, frame);
      const [a, b, d, c, e, f] = G.root(G.at(belief.covariance, frame)).map((entry) => 2 * factor * entry);
      const vertices = design.ball.vertices;
      for (let m = 0, to = design.balls.firsts[n]; m < vertices.length; m += 3, to++) {
        const [x, y, z] = [vertices[m], vertices[m + 1], vertices[m + 2]];
        out.x[to] = px + a * x;
        out.y[to] = py + b * x + d * y;
        out.z[to] = pz + c * x + e * y + f * z;
      }
    });
    return out;
  }

  function springs(design, frame) {
    const lines = new G.Lines();
    for (const { kind, from, to } of design.connections) {
      if (kind !== "contact") lines.coil(G.at(from, frame), G.at(to, frame), 0.025 * design.size);
    }
    return lines;
  }

  /**
   * Arrows at second ends, outside of bodies as far as can be: what presses has its tip there, as contacts and
   * compressed springs do; what pulls begins there. Every arrow is the force on one side only: for a contact, on the robot.
   */
  function arrows(design, frame, key, scale, of, heads = 1) {
    const lines = new G.Lines();
    for (const connection of design.connections.filter(of)) {
      const vector = G.times(1 / scale, G.at(connection[key], frame));
      const point = G.at(connection.to, frame), along = G.sub(point, G.at(connection.from, frame));
      const pushes = connection.kind === "contact" || (connection.kind === "spring" && G.dot(along, vector) > 0);
      const from = pushes && key === "force" ? G.sub(point, vector) : point;
      if (G.length(vector) > 4e-3 * design.size) lines.arrow(from, vector, heads);
    }
    return lines;
  }

  /** The frame with the greatest contact force; the last one where nothing touches. */
  function strongest(design) {
    const force = (frame) => Math.max(0, ...design.connections.filter(touches).map((c) => G.length(G.at(c.force, frame))));
    const last = design.time.length - 1;
    return design.time.reduce((best, _, frame) => (force(frame) > force(best) ? frame : best), last);
  }

  const touches = (connection) => connection.kind === "contact";
  const pulls = (connection) => connection.kind !== "contact";

  /** Coordinates of each kind of trace at a frame. */
  function shape(kind, design, frame, scales, show) {
    switch (kind) {
      case "bodies": return bodies(design, frame);
      case "walls": return walls(design, frame, 0);
      case "edges": return edges(design, frame);
      case "bands": return walls(design, frame, scales.belief);
      case "springs": return springs(design, frame);
      case "pulls": return show.pulls ? arrows(design, frame, "force", scales.pull, pulls) : new G.Lines();
      case "forces": return show.forces ? arrows(design, frame, "force", scales.force, touches) : new G.Lines();
      case "torques": return show.pulls ? arrows(design, frame, "torque", scales.torque, () => true, 2) : new G.Lines();
      default: return beliefs(design, frame, scales.belief);
    }
  }

  /**
   * A colour of lines that are drawn after walls, which come before them in the order of kinds, and over them: arrows of
   * contacts lie behind the surface. What is not quite opaque is drawn last.
   */
  function above(colour) {
    return `rgba(${[1, 3, 5].map((n) => parseInt(colour.slice(n, n + 2), 16)).join(",")},0.99)`;
  }

  /** A trace of a kind. */
  function trace(kind, design, coordinates, style) {
    const common = { ...coordinates, scene: style.scene, hoverinfo: "skip", showlegend: false, name: design.name };
    const light = { ambient: 0.7, diffuse: 0.55, specular: 0.1, roughness: 0.7, fresnel: 0.1 };
    const shared = palette(style.dark), own = colour(design.index, style.dark);
    const mesh = ({ i, j, k }, more) => ({
      type: "mesh3d", i, j, k, flatshading: true, lighting: light, lightposition: { x: 1e4, y: -2e4, z: 3e4 },
      ...common, ...more,
    });
    const line = (color, width) => ({ type: "scatter3d", mode: "lines", line: { color, width }, ...common });
    switch (kind) {
      case "bodies": return mesh(design.model, { facecolor: tints(design, style.dark), opacity: style.opacity });
      // Faint, with edges: what touches a wall, and how it is pressed, is seen through it from either side.
      case "walls": return mesh(design.plates, { color: shared.wall, opacity: 0.2 });
      case "edges": return line(shared.wall, 2);
      case "bands": return mesh(design.plates, { color: own, opacity: 0.12 });
      case "springs": return line(shared.spring, 3);
      case "pulls": return line(above(shared.spring), 3);
      case "forces": return line(above(shared.force), 6);
      case "torques": return line(above(shared.torque), 4);
      default: return mesh(design.balls, { color: own, opacity: 0.25, flatshading: false });
    }
  }

  /** Whether a design has anything of a kind. */
  function has(kind, design) {
    const any = (key, of) => design.connections.some((c) => of(c) && c[key].some((row) => G.length(row) > 0));
    switch (kind) {
      case "bodies": return design.model.count > 0;
      case "walls": case "edges": return design.walls.length > 0;
      case "bands": return design.walls.some((wall) => wall.deviation.some((d) => d > 0));
      case "springs": return design.connections.some(pulls);
      case "pulls": return any("force", pulls);
      case "forces": return any("force", touches);
      case "torques": return any("torque", () => true);
      default: return design.beliefs.length > 0;
    }
  }

  /** Scales of all designs: how many N, or N m, are an arrow of 1 m; and how much larger beliefs are drawn. */
  function scales(designs) {
    const size = Math.max(...designs.map((design) => design.size));
    const most = (lists) => lists.flat().reduce((best, value) => (value > best ? value : best), 0);
    const largest = (key, of) => most(designs.flatMap((d) => d.connections.filter(of).map((c) => c[key].map(G.length))));
    const scale = (largest) => (largest > 0 ? G.niceAbove(largest / (0.45 * size)) : 1);
    const points = designs.flatMap((d) => d.beliefs.map((b) => b.covariance.map((c) => Math.sqrt(Math.max(c[0], c[3], c[5])))));
    const walls = designs.flatMap((d) => d.walls.map((wall) => wall.deviation));
    const widest = 2 * most([...points, ...walls]);
    const belief = widest > 0 ? Math.max(1, Math.min(1000, G.nice((0.08 * size) / widest))) : 1;
    // Contacts and springs share a scale, unless the weaker ones would be too short to be seen.
    const [touch, pull] = [largest("force", touches), largest("force", pulls)];
    const apart = touch > 0 && pull > 0 && !(touch / pull < 3 && pull / touch < 3), both = Math.max(touch, pull);
    return {
      size, belief, force: scale(apart ? touch : both), pull: scale(apart ? pull : both),
      torque: scale(largest("torque", () => true)),
    };
  }

  /** Points of the frames of a design that the view is to hold: those of guides, such as rails, may lie outside. */
  function held(design, frame, scales) {
    const all = bodies(design, frame), kept = { x: [], y: [], z: [] };
    design.bodies.forEach((body, n) => {
      const first = design.model.firsts[n], last = first + design.surfaces[n].vertices.length / 3 - (body.guides || 0);
      for (const axis of ["x", "y", "z"]) kept[axis].push(all[axis].subarray(first, last));
    });
    const arrow = arrows(design, frame, "force", scales.force, touches);
    for (const axis of ["x", "y", "z"]) kept[axis] = [...kept[axis], arrow[axis]];
    return kept;
  }

  /**
   * The box about what the robot and its contacts take along the plan: bodies, walls, and the forces between them, at no more
   * than some frames; wide enough in each direction to look around in.
   */
  function bounds(designs, scales) {
    const FRAMES = 26;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const take = ({ x, y, z }) => [x, y, z].forEach((list, n) => {
      for (const value of list) {
        if (value === null) continue;
        if (value < low[n]) low[n] = value;
        if (value > high[n]) high[n] = value;
      }
    });
    for (const design of designs) {
      const last = design.time.length - 1, gaps = Math.max(1, Math.min(last, FRAMES - 1));
      for (let shot = 0; shot <= gaps; shot++) {
        const frame = Math.round((shot * last) / gaps);
        const { x, y, z } = held(design, frame, scales);
        x.forEach((list, n) => take({ x: list, y: y[n], z: z[n] }));
        if (design.walls.length) take(walls(design, frame, 0));
      }
    }
    const longest = Math.max(...high.map((v, n) => v - low[n]), 1e-9);
    return low.map((v, n) => {
      const middle = (v + high[n]) / 2, half = Math.max((high[n] - v) / 2 + 0.06 * longest, 0.13 * longest);
      return Number.isFinite(middle) ? [middle - half, middle + half] : [-0.5, 0.5];
    });
  }

  /** Whether a box still serves for what takes another one: it holds that, and is not much larger. */
  function fits(box, other) {
    const longest = (one) => Math.max(...one.map(([low, high]) => high - low));
    const room = 0.05 * longest(box);
    return longest(box) < 2 * longest(other)
      && box.every(([low, high], n) => other[n][0] > low - room && other[n][1] < high + room);
  }

  /** Where the camera is at first: from the side that shows most of the box, a little from above. */
  function camera(box) {
    const [a, b] = box.map(([low, high]) => high - low);
    const angle = a >= b ? -0.32 * Math.PI : -0.18 * Math.PI;
    const [out, up] = [1.45, 0.62];
    return {
      eye: { x: out * Math.cos(angle), y: out * Math.sin(angle), z: up },
      center: { x: 0, y: 0, z: -0.05 }, up: { x: 0, y: 0, z: 1 },
    };
  }

  /**
   * How many units of plotly a metre may have, so that the window holds all corners of a box and, beside it, the numbers of
   * its axes.
   */
  function largest(lengths, { eye, center }, aspect) {
    // Half of what the camera sees, at distance 1; the share of it that the box may take.
    const HALF = Math.tan(Math.PI / 8), ACROSS = 0.72, UP = 0.84;
    const at = [eye.x, eye.y, eye.z], back = G.sub(at, [center.x, center.y, center.z]);
    const away = G.times(1 / G.length(back), back);
    const right = G.times(1 / Math.hypot(away[0], away[1]), [-away[1], away[0], 0]);
    const up = [away[1] * right[2] - away[2] * right[1], away[2] * right[0] - away[0] * right[2],
      away[0] * right[1] - away[1] * right[0]];
    const holds = (unit) => [...Array(8).keys()].every((n) => {
      const corner = lengths.map((length, axis) => unit * length * (n >> axis & 1 ? 0.5 : -0.5));
      const from = G.sub(corner, at), deep = -G.dot(from, away);
      return deep > 0.1 && Math.abs(G.dot(from, right)) <= ACROSS * HALF * aspect * deep
        && Math.abs(G.dot(from, up)) <= UP * HALF * deep;
    });
    let [low, high] = [0, 4 / Math.max(...lengths)];
    for (let n = 0; n < 40; n++) {
      const middle = (low + high) / 2;
      if (holds(middle)) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Layout of `count` scenes beside or below one another. */
  function layout(count, box, eye, style, names) {
    const lengths = box.map(([low, high]) => high - low);
    const unit = largest(lengths, camera(box), style.aspect);
    const [width, depth, height] = lengths.map((length) => unit * length);
    const axis = (title, n) => ({
      title: { text: title, font: { size: 11 * style.size } }, range: box[n], autorange: false, nticks: 4, showbackground: false,
      color: style.text, gridcolor: style.faint, zeroline: false, showspikes: false, tickfont: { size: 10 * style.size },
    });
    const out = {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false, uirevision: "supple",
      font: { color: style.text, family: "sans-serif" }, annotations: [],
    };
    for (let n = 0; n < count; n++) {
      const span = [n / count, (n + 1) / count];
      const domain = style.narrow ? { x: [0, 1], y: [1 - span[1], 1 - span[0]] } : { x: span, y: [0, 1] };
      out[n ? `scene${n + 1}` : "scene"] = {
        domain, xaxis: axis("x (m)", 0), yaxis: axis("y (m)", 1), zaxis: axis("z (m)", 2), aspectmode: "manual",
        aspectratio: { x: width, y: depth, z: height },
        camera: eye, dragmode: "orbit", hovermode: false,
      };
      if (names[n]) {
        out.annotations.push({
          text: names[n], x: domain.x[0], y: domain.y[1], xref: "paper", yref: "paper", xanchor: "left", yanchor: "top",
          showarrow: false, font: { size: 13 * style.size, color: style.text }, xshift: 8, yshift: -4,
        });
      }
    }
    return out;
  }

  S.figure = { KINDS, palette, colour, moves, prepare, shape, trace, has, scales, bounds, fits, strongest, camera, layout };
})((window.SuppleScene = window.SuppleScene || {}));
