// Light or dark: the system's choice unless the reader makes one, which the browser remembers where it may.
import { el } from "./dom";

type Theme = "system" | "light" | "dark";
const kNames: Record<Theme, string> = { system: "auto", light: "light", dark: "dark" };
const kKey = "assay-theme";
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const listeners: (() => void)[] = [];

function kept(): Theme {
  try {
    const stored = localStorage.getItem(kKey);
    return stored === "light" || stored === "dark" ? stored : "system";
  } catch {
    return "system"; // pages from a file may have no storage
  }
}

let chosen = kept();

function apply(): void {
  document.documentElement.dataset.theme = chosen === "system" ? (dark.matches ? "dark" : "light") : chosen;
  for (const listener of listeners) listener();
}

export function onTheme(listener: () => void): void {
  listeners.push(listener);
}

export function themeSwitch(): HTMLElement {
  const select = el("select", { class: "theme", "aria-label": "Colour theme" }, ...(Object.keys(kNames) as Theme[]).map((theme) => el("option", { value: theme, selected: theme === chosen }, `theme: ${kNames[theme]}`)));
  select.addEventListener("change", () => {
    chosen = select.value as Theme;
    try {
      localStorage.setItem(kKey, chosen);
    } catch {
      // It holds until the page is closed.
    }
    apply();
  });
  return el("div", { class: "theme-switch" }, select);
}

dark.addEventListener("change", apply);
apply();
