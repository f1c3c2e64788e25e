// What plotly draws: traces of each design at each frame, their scales, ranges and layout.
(function (S) {
  "use strict";
  const G = S.geometry;

  // Okabe and Ito: to be told apart by all.
  const COLOURS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"];
  const FORCE = "#d62728", TORQUE = "#9467bd";
  const KINDS = ["bodies", "walls", "bands", "springs", "forces", "torques", "beliefs"];

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
    const colour = COLOURS[index % COLOURS.length];
    const moving = (body) => body.position.length > 1 || body.rotation.length > 1;
    const tints = bodies.map((body, n) => {
      if (!moving(body)) return "#8a8f98";
      return n % 2 ? mix(colour, "#ffffff", 0.3) : colour;
    });
    const shared = before && before.colour === colour && before.surfaces.length === surfaces.length
      && surfaces.every((surface, n) => surface === before.surfaces[n]);
    if (shared) {
      const { model, facecolor } = before;
      const plates = before.walls.length === design.walls.length ? before.plates : G.merge(design.walls.map(() => cube));
      const balls = before.beliefs.length === design.beliefs.length ? before.balls : G.merge(design.beliefs.map(() => ball));
      return { ...design, bodies, surfaces, model, facecolor, ball, cube, colour, plates, balls };
    }
    const model = G.merge(surfaces);
    return {
      ...design, bodies, surfaces, model, ball, cube, colour,
      facecolor: model.of.map((n) => tints[n]),
      plates: G.merge(design.walls.map(() => cube)),
      balls: G.merge(design.beliefs.map(() => ball)),
    };
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
   * compressed springs do; what pulls begins there.
   */
  function arrows(design, frame, key, scale, heads) {
    const lines = new G.Lines();
    for (const connection of design.connections) {
      const vector = G.times(1 / scale, G.at(connection[key], frame));
      const point = G.at(connection.to, frame), along = G.sub(point, G.at(connection.from, frame));
      const pushes = connection.kind === "contact" || (connection.kind === "spring" && G.dot(along, vector) > 0);
      const from = pushes && key === "force" ? G.sub(point, vector) : point;
      if (G.length(vector) > 4e-3 * design.size) lines.arrow(from, vector, heads);
    }
    return lines;
  }

  /** Coordinates of each kind of trace at a frame. */
  function shape(kind, design, frame, scales, show) {
    switch (kind) {
      case "bodies": return bodies(design, frame);
      case "walls": return walls(design, frame, 0);
      case "bands": return walls(design, frame, scales.belief);
      case "springs": return springs(design, frame);
      case "forces": return show.forces ? arrows(design, frame, "force", scales.force, 1) : new G.Lines();
      case "torques": return show.forces ? arrows(design, frame, "torque", scales.torque, 2) : new G.Lines();
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
    const light = { ambient: 0.55, diffuse: 0.7, specular: 0.15, roughness: 0.7, fresnel: 0.1 };
    const mesh = ({ i, j, k }, more) => ({
      type: "mesh3d", i, j, k, flatshading: true, lighting: light, lightposition: { x: 1e4, y: -2e4, z: 3e4 },
      ...common, ...more,
    });
    const line = (color, width) => ({ type: "scatter3d", mode: "lines", line: { color, width }, ...common });
    switch (kind) {
      case "bodies": return mesh(design.model, { facecolor: design.facecolor, opacity: style.opacity });
      case "walls": return mesh(design.plates, { color: style.dark ? "#9aa0aa" : "#7a7f88", opacity: 0.5 });
      case "bands": return mesh(design.plates, { color: design.colour, opacity: 0.25 });
      case "springs": return line(mix(design.colour, style.dark ? "#ffffff" : "#000000", 0.35), 3);
      case "forces": return line(above(FORCE), 6);
      case "torques": return line(above(TORQUE), 6);
      default: return mesh(design.balls, { color: design.colour, opacity: 0.3, flatshading: false });
    }
  }

  /** Whether a design has anything of a kind. */
  function has(kind, design) {
    const any = (key) => design.connections.some((c) => c[key].some((row) => G.length(row) > 0));
    switch (kind) {
      case "bodies": return design.model.count > 0;
      case "walls": return design.walls.length > 0;
      case "bands": return design.walls.some((wall) => wall.deviation.some((d) => d > 0));
      case "springs": return design.connections.some((c) => c.kind !== "contact");
      case "forces": return any("force");
      case "torques": return any("torque");
      default: return design.beliefs.length > 0;
    }
  }

  /** One scale for all designs: how many N, or N m, are an arrow of 1 m; and how much larger beliefs are drawn. */
  function scales(designs) {
    const size = Math.max(...designs.map((design) => design.size));
    const most = (lists) => lists.flat().reduce((best, value) => (value > best ? value : best), 0);
    const strongest = (key) => most(designs.flatMap((d) => d.connections.map((c) => c[key].map(G.length))));
    const scale = (largest) => (largest > 0 ? G.niceAbove(largest / (0.45 * size)) : 1);
    const points = designs.flatMap((d) => d.beliefs.map((b) => b.covariance.map((c) => Math.sqrt(Math.max(c[0], c[3], c[5])))));
    const walls = designs.flatMap((d) => d.walls.map((wall) => wall.deviation));
    const widest = 2 * most([...points, ...walls]);
    const belief = widest > 0 ? Math.max(1, Math.min(1000, G.nice((0.08 * size) / widest))) : 1;
    return { size, force: scale(strongest("force")), torque: scale(strongest("torque")), belief };
  }

  /** The box about all bodies and walls at all frames, wide enough in each direction to look around in. */
  function bounds(designs) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const take = ({ x, y, z }) => [x, y, z].forEach((list, n) => {
      for (const value of list) {
        if (value < low[n]) low[n] = value;
        if (value > high[n]) high[n] = value;
      }
    });
    for (const design of designs) {
      for (let frame = 0; frame < design.time.length; frame++) {
        take(bodies(design, frame));
        if (design.walls.length) take(walls(design, frame, 0));
      }
    }
    const longest = Math.max(...high.map((v, n) => v - low[n]), 1e-9);
    return low.map((v, n) => {
      const middle = (v + high[n]) / 2, half = Math.max((high[n] - v) / 2 + 0.06 * longest, 0.18 * longest);
      return Number.isFinite(middle) ? [middle - half, middle + half] : [-0.5, 0.5];
    });
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

  /** Layout of `count` scenes beside or below one another. */
  function layout(count, box, eye, style, names) {
    const lengths = box.map(([low, high]) => high - low);
    // As large as the window lets it be: plotly sees about one unit up and down from where the camera is.
    const wide = Math.min(style.aspect, 1.7);
    const unit = Math.min(1.15 / lengths[2], (1.2 * wide) / Math.hypot(lengths[0], lengths[1]));
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

  S.figure = { COLOURS, FORCE, TORQUE, KINDS, prepare, shape, trace, has, scales, bounds, camera, layout };
})((window.SuppleScene = window.SuppleScene || {}));
