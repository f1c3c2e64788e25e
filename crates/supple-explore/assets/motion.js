"use strict";
// The robot in motion. It is drawn after numbers and curves, and only as often as the browser keeps up.
(function (E) {
  const D = E.design;
  // Browsers without a graphics card take long for a picture, with all processors: there the robot follows when sliders rest
  // and no answer is waited for.
  const FAST = 60, REST = 200;
  // Places of colours in the view: pins have those of their curves.
  const COLOURS = { now: 0, A: 3, B: 1, C: 4 };
  let meshes = [], warnings = [], view = null, waiting = 0, took = 0, before = new Map();

  /** Surfaces that came with an answer. */
  function take({ first, list, warnings: said }) {
    if (first === 0 && list.length) meshes = [];
    const bytes = window.SuppleScene ? SuppleScene.geometry.bytes : null;
    list.forEach((mesh, n) => { meshes[first + n] = bytes ? decoded(mesh) : mesh; });
    warnings = said;
  }

  function decoded(mesh) {
    const { bytes } = SuppleScene.geometry;
    return mesh.faces instanceof Uint32Array ? mesh
      : { vertices: new Float32Array(bytes(mesh.vertices)), faces: new Uint32Array(bytes(mesh.faces)) };
  }

  function designs() {
    const list = [["now", E.now], ...D.pins.map((pin) => [pin.name, pin.answer])];
    return list.filter(([, answer]) => answer?.scene && answer.numbers.planned).map(([name, answer]) => ({ ...answer.scene, name }));
  }

  function show() {
    if (waiting && took <= FAST) return;
    clearTimeout(waiting);
    // Behind the paint of what is faster.
    waiting = setTimeout(() => {
      waiting = 0;
      draw();
    }, took > FAST ? REST : 0);
  }

  /** An answer is waited for, after which it is shown. */
  function wait() {
    if (took <= FAST) return;
    clearTimeout(waiting);
    waiting = 0;
  }

  function draw() {
    const list = designs(), place = document.getElementById("scene");
    document.getElementById("motion").hidden = !list.length && !view;
    if (!list.length || !window.SuppleScene || !window.Plotly) return;
    if (view?.busy) {
      view.busy.then(show);
      return;
    }
    meshes = meshes.map(decoded);
    const began = performance.now();
    const drawn = () => { took = performance.now() - began; };
    if (!view) {
      // The view decodes surfaces itself; here they are there already.
      view = SuppleScene.mount(place, { meshes: [], designs: [], warnings }, list.map(prepared));
      place.dataset.shown = "1";
      view.busy?.then(drawn);
      return;
    }
    view.replace(list.map(prepared));
    view.busy?.then(drawn);
    place.dataset.shown = String(Number(place.dataset.shown) + 1);
  }

  function prepared(design) {
    const made = SuppleScene.figure.prepare(design, meshes, COLOURS[design.name] ?? 0, before.get(design.name));
    before.set(design.name, made);
    return made;
  }

  /** Another task: its scene may have other bodies. */
  function clear() {
    view?.pause();
    if (view) Plotly.purge(view.view);
    view = null;
    before = new Map();
    document.getElementById("scene").replaceChildren();
  }

  E.motion = { take, show, wait, clear, surface: (index) => meshes[index] };
})(window.Explore);
