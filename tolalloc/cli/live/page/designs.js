// Pinned designs beside each other: a table, and parallel coordinates with cost and yield among the axes.

import { colour, node, number } from "./chart.js";
import { make } from "./zones.js";

export class Designs {
  constructor(element, { currency, take }) {
    Object.assign(this, { element, currency, take, pinned: [], count: 0 });
  }

  pin(record) {
    this.pinned.push({ ...record, name: `design ${++this.count}` });
    this.draw();
  }

  drop(record) {
    this.pinned = this.pinned.filter((own) => own !== record);
    this.draw();
  }

  get ghosts() {
    return this.pinned.map((own, place) => ({ ...own.curve, label: own.name, ghost: true, colour: colour(place + 2) })).filter((own) => own.x);
  }

  draw() {
    this.element.hidden = !this.pinned.length;
    if (!this.pinned.length) return;
    const heads = ["design", `cost [${this.currency}]`, "yield [%], 95 % interval", "units [-]", ...this.pinned[0].outputs.flatMap((own) => own.quantiles.map(({ share }) => `${own.name} [${own.unit}], ${number(100 * Math.max(share, 1 - share))} % of units ${share < 0.5 ? "above" : "below"}`)), ""];
    const rows = this.pinned.map((own, place) => make("tr", {},
      make("td", {}, make("i", { style: `background: ${colour(place + 2)}` }), own.name), make("td", { class: "number" }, own.cost.toFixed(2)),
      make("td", { class: "number" }, `${(100 * own.yield[0]).toFixed(2)} (${(100 * own.yield[1]).toFixed(2)}…${(100 * own.yield[2]).toFixed(2)})`),
      make("td", { class: "number" }, String(own.units)), ...own.outputs.flatMap((item) => item.quantiles.map(({ value }) => make("td", { class: "number" }, number(value)))),
      make("td", {}, make("button", { onclick: () => this.take(own) }, "take"), make("button", { onclick: () => this.drop(own), "aria-label": `drop ${own.name}` }, "drop"))));
    const table = make("table", { class: "data" }, make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", {}, text)))), make("tbody", {}, ...rows));
    this.element.querySelector("#pinned").replaceChildren(table);
    this.element.querySelector("#parallel").replaceChildren(...(this.pinned.length > 1 ? [this.parallel()] : []));
  }

  // Only what differs between the designs is an axis.
  parallel() {
    const axes = [["cost", (own) => own.cost], ["yield [%]", (own) => 100 * own.yield[0]]];
    const names = new Set(this.pinned.flatMap((own) => Object.keys(own.values)));
    for (const name of names) axes.push([name, (own) => own.values[name]]);
    const shown = axes.filter(([, of], place) => place < 2 || new Set(this.pinned.map(of)).size > 1);
    const wide = 130, left = 110, width = left + wide * (shown.length - 1) + 40, height = 300, top = 22, bottom = 120;
    const svg = node("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": "Pinned designs, an axis for everything that differs" });
    const place = shown.map(([, of]) => {
      const values = this.pinned.map(of), low = Math.min(...values), high = Math.max(...values);
      return (own) => (low === high ? (height - bottom + top) / 2 : height - bottom - ((of(own) - low) / (high - low)) * (height - bottom - top));
    });
    shown.forEach(([name, of], k) => {
      const x = left + wide * k, values = this.pinned.map(of);
      svg.append(node("line", { class: "grid", x1: x, x2: x, y1: top, y2: height - bottom }));
      svg.append(node("text", { class: "tick", x, y: top - 8, "text-anchor": "middle" }, number(Math.max(...values))));
      svg.append(node("text", { class: "tick", x, y: height - bottom + 14, "text-anchor": "middle" }, number(Math.min(...values))));
      svg.append(node("text", { class: "label", x, y: height - bottom + 30, "text-anchor": "end", transform: `rotate(-25 ${x} ${height - bottom + 30})` }, name));
    });
    this.pinned.forEach((own, k) => {
      const path = shown.map((_, axis) => `${axis ? "L" : "M"}${left + wide * axis} ${place[axis](own).toFixed(1)}`).join("");
      const line = node("path", { d: path, fill: "none", stroke: colour(k + 2), "stroke-width": 2 });
      line.append(node("title", {}, own.name));
      svg.append(line);
    });
    const frame = make("div", { class: "chart" });
    frame.append(svg);
    return frame;
  }
}
