"use strict";
// Light or dark, as the reader chooses or the system says; and the colours of plots in both.
const SuppleTheme = (() => {
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  let printing = false;

  // Okabe and Ito's colours, made lighter where the paper is dark.
  const LIGHT = {
    paper: "#ffffff", ink: "#1b1b1b", faint: "#d9d9d9", mark: "#ffffff",
    1: "#0072b2", 2: "#d55e00", 3: "#009e73", 4: "#b0558c", 5: "#c98500", 6: "#3d9bd1", 7: "#6b6b6b",
  };
  const DARK = {
    paper: "#17181a", ink: "#e8e6e1", faint: "#3c3e42", mark: "#17181a",
    1: "#56b4e9", 2: "#f0803c", 3: "#2bc49a", 4: "#e3a3c8", 5: "#f2b632", 6: "#a9d8f5", 7: "#b5b5b5",
  };

  function isDark() {
    const chosen = root.dataset.theme;
    return !printing && (chosen === "dark" || (chosen !== "light" && dark.matches));
  }

  // The colour that a name such as "@1" or "@ink/0.4" stands for; other colours as they are.
  function colour(name) {
    if (typeof name !== "string" || !name.startsWith("@")) return name;
    const [key, opacity] = name.slice(1).split("/");
    const hex = (isDark() ? DARK : LIGHT)[key];
    if (opacity === undefined) return hex;
    const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
    return `rgba(${parts.join(",")},${opacity})`;
  }

  function tell() {
    listeners.forEach((listener) => listener());
  }

  function choose(theme) {
    if (theme === "auto") delete root.dataset.theme;
    else root.dataset.theme = theme;
    tell();
  }

  dark.addEventListener("change", tell);
  const select = document.getElementById("theme");
  select.addEventListener("change", () => choose(select.value));
  return {
    colour,
    isDark,
    onChange: (listener) => listeners.push(listener),
    print: (now) => { printing = now; },
  };
})();
