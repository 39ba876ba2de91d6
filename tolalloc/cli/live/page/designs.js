// Pinned designs: a line of each that stays in view, a table, and parallel coordinates with cost and yield among the axes.

import { colour, node, number } from "./chart.js";
import { make } from "./zones.js";

export class Designs {
  // changed() is called when there are other pinned designs, or when they are known better.
  constructor(element, { currency, take, changed }) {
    Object.assign(this, { element, currency, take, changed, pinned: [], count: 0 });
  }

  pin(record) {
    const used = this.pinned.map((own) => own.place);
    let place = 2; // the first two colours are those of the present design
    while (used.includes(place)) place++;
    this.pinned.push({ ...record, name: `design ${++this.count}`, place, colour: colour(place) });
    this.update();
  }

  drop(record) {
    this.pinned = this.pinned.filter((own) => own !== record);
    this.update();
  }

  // What more units say of a pinned design.
  refine(record, judged) {
    Object.assign(record, { units: judged.units, yield: judged.yield, outputs: judged.outputs });
    this.update();
  }

  // Take over those of a page that is loaded again.
  restore(pinned) {
    this.pinned = pinned;
    this.count = Math.max(0, ...pinned.map((own) => Number(own.name.split(" ")[1])));
    this.update();
  }

  update() {
    this.draw();
    this.line();
    this.changed();
  }

  line() {
    const list = document.getElementById("pins");
    list.hidden = !this.pinned.length;
    list.replaceChildren(...this.pinned.map((own) => make("li", {}, make("i", { style: `background: ${own.colour}` }),
      `${own.name}: ${own.cost.toFixed(2)}, ${(100 * own.yield[0]).toFixed(2)} % of ${own.units.toLocaleString("en-US")} units`)));
  }

  draw() {
    this.element.hidden = !this.pinned.length;
    if (!this.pinned.length) return;
    const same = this.rows?.size === this.pinned.length && this.pinned.every((own) => this.rows.has(own));
    if (same) for (const row of this.rows.values()) row.fill(); // buttons stay, and so does who stands on one
    else this.table();
    this.element.querySelector("#parallel").replaceChildren(...(this.pinned.length > 1 ? [this.parallel()] : []));
  }

  table() {
    const heads = ["design", `cost [${this.currency}]`, "yield [%], 95 % interval", "units [-]", ...this.pinned[0].outputs.flatMap((own) => own.quantiles.map(({ share }) => `${own.name} [${own.unit}], ${number(100 * Math.max(share, 1 - share))} % of units ${share < 0.5 ? "above" : "below"}`)), "take or drop"];
    this.rows = new Map(this.pinned.map((own) => [own, this.row(own)]));
    const table = make("table", { class: "data" }, make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", {}, text)))), make("tbody", {}, ...this.rows.values()));
    this.element.querySelector("#pinned").replaceChildren(table);
  }

  row(own) {
    const buttons = make("td", {}, make("button", { onclick: () => this.take(own), "aria-label": `take ${own.name}` }, "take"), make("button", { onclick: () => this.drop(own), "aria-label": `drop ${own.name}` }, "drop"));
    const row = make("tr", {}, buttons), cell = (text) => make("td", { class: "number" }, text);
    row.fill = () => {
      while (row.firstChild !== buttons) row.firstChild.remove();
      buttons.before(make("td", {}, make("i", { style: `background: ${own.colour}` }), own.name), cell(own.cost.toFixed(2)),
        cell(`${(100 * own.yield[0]).toFixed(2)} (${(100 * own.yield[1]).toFixed(2)}…${(100 * own.yield[2]).toFixed(2)})`), cell(own.units.toLocaleString("en-US")),
        ...own.outputs.flatMap((item) => item.quantiles.map(({ value }) => cell(number(value)))));
    };
    row.fill();
    return row;
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
    this.pinned.forEach((own) => {
      const path = shown.map((_, axis) => `${axis ? "L" : "M"}${left + wide * axis} ${place[axis](own).toFixed(1)}`).join("");
      const line = node("path", { d: path, fill: "none", stroke: own.colour, "stroke-width": 2 });
      line.append(node("title", {}, own.name));
      svg.append(line);
    });
    const frame = make("div", { class: "chart", tabindex: 0, role: "group", "aria-label": "Pinned designs side by side" });
    frame.append(svg);
    return frame;
  }
}
