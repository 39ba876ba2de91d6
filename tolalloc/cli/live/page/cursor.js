// One place of the curve: on the chart, under a slider, and as the angle of the moving picture.

import { number, valueAt } from "./chart.js";

const at = (id) => document.getElementById(id);
const shown = (value) => `${value < -0.05 ? "−" : ""}${Math.abs(value).toFixed(1)}`;

// "carrier angle [°]" with a value: "carrier angle 12.5°".
function said(label, text) {
  const [, name, unit] = /^(.*?)(?: ?\[(.*)\])?$/.exec(label);
  return `${name} ${text}${unit === "°" ? "°" : unit && unit !== "-" ? ` ${unit}` : ""}`;
}

export class Cursor {
  // turned(angle) is called with a value that a hand chose, pointed(angle) with one under the pointer.
  constructor({ turned, pointed }) {
    Object.assign(this, { pointed, value: null, chart: null, line: null });
    at("cursor-place").addEventListener("input", () => {
      this.mark(Number(at("cursor-place").value));
      turned(this.value);
    });
  }

  // The first figure of a unit, on its chart; nothing where the model has no curve.
  show(chart, figure) {
    this.line = figure?.series.findLast((own) => !own.ghost && own.kind === "line") ?? null;
    at("cursor").hidden = !this.line;
    if (!this.line) return;
    Object.assign(this, { chart, figure });
    chart.onCursor = (value) => {
      this.mark(value);
      this.pointed(this.value);
    };
    const [low, high] = [this.line.x[0], this.line.x.at(-1)];
    Object.assign(at("cursor-place"), { min: low, max: high, step: (high - low) / 720 });
    this.mark(this.value ?? low);
  }

  // The value of the curve that is shown, nothing without one.
  valueAt(place) {
    return this.line && valueAt(this.line, place);
  }

  mark(value) {
    if (!this.line) return void (this.value = value);
    this.value = Math.max(this.line.x[0], Math.min(this.line.x.at(-1), value));
    this.chart.mark(this.value);
    const { x_label, y_label, series } = this.figure, here = valueAt(this.line, this.value);
    const others = series.filter((own) => own.ghost).map((own) => `${own.label} ${shown(valueAt(own, this.value))}`);
    const angle = said(x_label, x_label.includes("°") ? shown(this.value) : number(this.value));
    const text = `${angle}: ${said(y_label ?? "", here === null ? "–" : Math.abs(here) >= 1 ? shown(here) : number(here))}${others.length ? ` (${others.join(", ")})` : ""}`;
    at("cursor-value").textContent = text;
    if (document.activeElement !== at("cursor-place")) at("cursor-place").value = this.value;
    at("cursor-place").setAttribute("aria-valuetext", text);
  }
}
