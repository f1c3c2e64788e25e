// The numbers behind the view of a robot in motion: surfaces, poses, arrows and ellipsoids. No drawing here.
(function (S) {
  "use strict";

  function bytes(text) {
    const raw = atob(text);
    const out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out.buffer;
  }

  /** The row of a track at a frame: a track with one row is the same at all times. */
  function at(track, frame) {
    return track[Math.min(frame, track.length - 1)];
  }

  /** Points of a body's frame to the world, written from place `first` on. */
  function place(vertices, [px, py, pz], [w, x, y, z], out, first) {
    const r = [
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ];
    for (let i = 0, to = first; i < vertices.length; i += 3, to++) {
      const a = vertices[i], b = vertices[i + 1], c = vertices[i + 2];
      out.x[to] = r[0] * a + r[1] * b + r[2] * c + px;
      out.y[to] = r[3] * a + r[4] * b + r[5] * c + py;
      out.z[to] = r[6] * a + r[7] * b + r[8] * c + pz;
    }
  }

  function coordinates(count) {
    return { x: new Float32Array(count), y: new Float32Array(count), z: new Float32Array(count) };
  }

  /** Surfaces with `[{ vertices, faces }]` as one, with the number of the surface that each face is of. */
  function merge(surfaces) {
    const i = [], j = [], k = [], of = [], firsts = [];
    let count = 0;
    surfaces.forEach((surface, index) => {
      firsts.push(count);
      for (let f = 0; f < surface.faces.length; f += 3) {
        i.push(count + surface.faces[f]);
        j.push(count + surface.faces[f + 1]);
        k.push(count + surface.faces[f + 2]);
        of.push(index);
      }
      count += surface.vertices.length / 3;
    });
    return { i, j, k, of, firsts, count };
  }

  /** A ball of radius 1. */
  function ball(around, across) {
    const vertices = [], faces = [];
    for (let row = 0; row <= across; row++) {
      for (let column = 0; column < around; column++) {
        const polar = (Math.PI * row) / across, angle = (2 * Math.PI * column) / around;
        vertices.push(Math.sin(polar) * Math.cos(angle), Math.sin(polar) * Math.sin(angle), Math.cos(polar));
        const next = (column + 1) % around;
        const [a, b] = [row * around + column, row * around + next];
        if (row < across) faces.push(a, a + around, b, b, a + around, b + around);
      }
    }
    return { vertices: new Float32Array(vertices), faces: new Uint32Array(faces) };
  }

  /** A box with edges 1 about the origin. */
  function cube() {
    const vertices = [];
    for (let n = 0; n < 8; n++) vertices.push((n & 1) - 0.5, ((n >> 1) & 1) - 0.5, ((n >> 2) & 1) - 0.5);
    const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    const faces = quads.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);
    return { vertices: new Float32Array(vertices), faces: new Uint32Array(faces) };
  }

  /**
   * The lower Cholesky factor of a covariance `xx, xy, xz, yy, yz, zz` plus a little of its trace: its directions times
   * a ball are the ellipsoid of one standard deviation, and one that is flat can still be seen.
   */
  function root([xx, xy, xz, yy, yz, zz]) {
    const least = 1e-2 * Math.max(xx, yy, zz, 0);
    const positive = (value) => Math.sqrt(Math.max(value, least));
    const a = positive(xx + least);
    if (!(a > 0)) return [0, 0, 0, 0, 0, 0];
    const b = xy / a, c = xz / a;
    const d = positive(yy + least - b * b);
    const e = (yz - b * c) / d;
    return [a, b, d, c, e, positive(zz + least - c * c - e * e)];
  }

  const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const times = (s, a) => [s * a[0], s * a[1], s * a[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const length = (a) => Math.hypot(a[0], a[1], a[2]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

  /** Two directions of length 1 across a direction and each other. */
  function across(direction) {
    const unit = times(1 / length(direction), direction);
    const least = [0, 1, 2].reduce((best, n) => (Math.abs(unit[n]) < Math.abs(unit[best]) ? n : best), 0);
    const helper = [0, 0, 0];
    helper[least] = 1;
    const first = cross(unit, helper);
    const one = times(1 / length(first), first);
    return [one, cross(unit, one)];
  }

  /** Lines with gaps, as plotly wants them. */
  class Lines {
    constructor() {
      this.x = [];
      this.y = [];
      this.z = [];
    }
    line(points) {
      for (const point of points) {
        this.x.push(point[0]);
        this.y.push(point[1]);
        this.z.push(point[2]);
      }
      this.x.push(null);
      this.y.push(null);
      this.z.push(null);
    }
    /** An arrow, with `heads` heads; nothing where it has no length. */
    arrow(from, vector, heads = 1) {
      const size = length(vector);
      if (!(size > 0)) return;
      const tip = add(from, vector);
      const [one, two] = across(vector);
      this.line([from, tip]);
      for (let head = 0; head < heads; head++) {
        const point = sub(tip, times(0.12 * head, vector));
        const base = sub(point, times(0.18, vector));
        for (const side of [one, times(-1, one), two, times(-1, two)]) {
          this.line([point, add(base, times(0.08 * size, side))]);
        }
      }
    }
    /** A coil between two points; straight where they are close. */
    coil(from, to, radius) {
      const along = sub(to, from), size = length(along);
      if (!(size > 1e-3 * radius)) return this.line([from, to]);
      const [one, two] = across(along);
      const turns = 7, corners = 10, points = [from];
      for (let n = 0; n <= turns * corners; n++) {
        const share = 0.1 + (0.8 * n) / (turns * corners), angle = (2 * Math.PI * n) / corners;
        const out = add(times(radius * Math.cos(angle), one), times(radius * Math.sin(angle), two));
        points.push(add(add(from, times(share, along)), out));
      }
      points.push(to);
      return this.line(points);
    }
  }

  /** The largest of 1, 2, 5, 10... that is at most `value`. */
  function nice(value) {
    const power = Math.pow(10, Math.floor(Math.log10(value)));
    const digit = value / power;
    return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
  }

  /** The least of 1, 2, 5, 10... that is at least `value`. */
  function niceAbove(value) {
    const below = nice(value);
    if (below >= value) return below;
    const digit = Math.round(below / Math.pow(10, Math.floor(Math.log10(below) + 1e-9)));
    return below * (digit === 2 ? 2.5 : 2);
  }

  S.geometry = {
    bytes, at, place, coordinates, merge, ball, cube, root, Lines, nice, niceAbove, length, times, add, sub, dot,
  };
})((window.SuppleScene = window.SuppleScene || {}));
