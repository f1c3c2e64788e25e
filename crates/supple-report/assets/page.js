"use strict";
// What happens when: plots are drawn when they come near, drawn anew when colours change, and all of them for print.
(() => {
  const { figures } = SupplePlots;
  const byElement = new Map(figures.map((figure) => [figure.element, figure]));

  const near = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((found) => found.isIntersecting)) {
      near.unobserve(entry.target);
      byElement.get(entry.target).draw();
    }
  }, { rootMargin: "400px" });
  figures.forEach((figure) => near.observe(figure.element));

  SuppleTheme.onChange(() => figures.filter((figure) => figure.drawn).forEach((figure) => figure.draw()));

  for (const place of document.querySelectorAll("[data-scene]")) {
    SuppleScene.mount(place, JSON.parse(place.parentElement.querySelector("script").textContent));
  }

  // On narrow screens the contents are folded until they are asked for.
  const contents = document.querySelector("nav details");
  const wide = matchMedia("(min-width: 70rem)");
  const fold = () => { contents.open = wide.matches; };
  wide.addEventListener("change", fold);
  fold();
  contents.addEventListener("click", (event) => {
    if (event.target.closest("a") && !wide.matches) contents.open = false;
  });

  // Which section is read is marked in the contents.
  const links = new Map([...contents.querySelectorAll("a")].map((link) => [link.hash.slice(1), link]));
  const here = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((found) => found.isIntersecting)) {
      links.forEach((link) => link.removeAttribute("aria-current"));
      links.get(entry.target.getAttribute("aria-labelledby"))?.setAttribute("aria-current", "location");
    }
  }, { rootMargin: "-10% 0px -80% 0px" });
  document.querySelectorAll("section[aria-labelledby]").forEach((section) => here.observe(section));

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
})();
