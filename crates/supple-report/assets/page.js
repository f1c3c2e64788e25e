"use strict";
// What happens when: data and plotly.js are unpacked; plots are drawn when they come near, drawn anew when colours
// change, and all of them for print.
(() => {
  // The text of a script element that is packed by gzip, in base64.
  async function unpacked(id) {
    const text = atob(document.getElementById(id).textContent);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i += 1) bytes[i] = text.charCodeAt(i);
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  function drawPlots(data) {
    const figures = supplePlots(data);
    const byElement = new Map(figures.map((figure) => [figure.element, figure]));
    const near = new IntersectionObserver((entries) => {
      for (const entry of entries.filter((found) => found.isIntersecting)) {
        near.unobserve(entry.target);
        byElement.get(entry.target).draw();
      }
    }, { rootMargin: "400px" });
    figures.forEach((figure) => near.observe(figure.element));
    SuppleTheme.onChange(() => figures.filter((figure) => figure.drawn).forEach((figure) => figure.draw()));
    SuppleTheme.onChange(() => document.dispatchEvent(new Event("supple-theme")));
    drawForPrint(figures);
  }

  function drawForPrint(figures) {
    let closed = [];
    addEventListener("beforeprint", () => {
      SuppleTheme.print(true);
      closed = [...document.querySelectorAll("main details:not([open])")];
      closed.forEach((details) => { details.open = true; });
      figures.forEach((figure) => figure.draw(true));
    });
    addEventListener("afterprint", () => {
      SuppleTheme.print(false);
      closed.forEach((details) => { details.open = false; });
      figures.forEach((figure) => figure.draw());
    });
  }

  async function draw() {
    const data = JSON.parse(await unpacked("data"));
    const library = document.createElement("script");
    library.textContent = await unpacked("library");
    document.head.append(library);
    drawPlots(data);
    for (const place of document.querySelectorAll("[data-scene]")) {
      SuppleScene.mount(place, data.scenes[Number(place.dataset.scene)]);
    }
    document.documentElement.dataset.ready = "yes";
  }

  function excuse() {
    const text = "This browser cannot draw the plots. Use a browser from 2023 or later.";
    document.querySelectorAll(".canvas, [data-scene]").forEach((place) => { place.textContent = text; });
  }

  // On narrow screens the contents are folded until they are asked for.
  function fold(contents) {
    const wide = matchMedia("(min-width: 70rem)");
    const follow = () => { contents.open = wide.matches; };
    wide.addEventListener("change", follow);
    follow();
    contents.addEventListener("click", (event) => {
      if (event.target.closest("a") && !wide.matches) contents.open = false;
    });
  }

  // Which section is read is marked in the contents.
  function mark(contents) {
    const links = new Map([...contents.querySelectorAll("a")].map((link) => [link.hash.slice(1), link]));
    const here = new IntersectionObserver((entries) => {
      for (const entry of entries.filter((found) => found.isIntersecting)) {
        links.forEach((link) => link.removeAttribute("aria-current"));
        links.get(entry.target.getAttribute("aria-labelledby"))?.setAttribute("aria-current", "location");
      }
    }, { rootMargin: "-10% 0px -80% 0px" });
    document.querySelectorAll("section[aria-labelledby]").forEach((section) => here.observe(section));
  }

  const contents = document.querySelector("nav details");
  fold(contents);
  mark(contents);
  if (typeof DecompressionStream === "undefined") excuse();
  else draw().catch((error) => { excuse(); console.error(error); });
})();
