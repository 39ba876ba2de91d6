// Cost over what is limited: where the present design stands, the pinned ones, and what the drawing costs at other limits.

import { number } from "./chart.js";
import { named } from "./verdict.js";
import { make } from "./zones.js";

export class CostChart {
  // draw(figure) draws it; present() returns what is shown, as `figure` takes it.
  constructor(element, present, draw) {
    Object.assign(this, { present, draw });
    this.choice = make("select", { "aria-label": "output of the cost chart", onchange: () => this.update() });
    element.append(this.choice);
  }

  // Every limited quantile is an axis that can be chosen: output and quantile by their places.
  choices(judged) {
    return judged.outputs.flatMap((own, output) => own.quantiles.map((item, place) => ({ output, place, name: `${own.name}, ${named(item.share)}`, own, share: item.share })));
  }

  update() {
    const shown = this.present();
    if (!shown.judged) return;
    const choices = this.choices(shown.judged), names = choices.map((own) => own.name);
    if (this.choice.options.length !== names.length) this.choice.replaceChildren(...names.map((name, place) => make("option", { value: place }, name)));
    this.choice.hidden = names.length < 2;
    this.draw(this.figure(choices[Math.max(this.choice.selectedIndex, 0)], shown));
  }

  figure({ output, place, own, share, name }, { judged, cost, currency, pins, scaled, found, byProcess }) {
    const value = (outputs) => outputs[output]?.quantiles[place]?.value ?? null, limit = share < 0.5 ? own.lower : own.upper, series = [];
    const line = (scaled ?? []).map((item) => [item.quantiles[output][place], item.cost]).filter(([x]) => x !== null);
    if (line.length > 1) series.push({ label: `the drawing, all zones scaled by one factor${byProcess ? ", by the cheapest processes" : ""}`, kind: "line", x: line.map(([x]) => x), y: line.map(([, y]) => y), colour: "var(--faint)" });
    if (found?.front && !output) series.push({ label: "cheapest at other limits", kind: "line", ...found.front, colour: "var(--series-1)" });
    for (const pin of pins) if (value(pin.outputs) !== null) series.push({ label: pin.name, kind: "points", x: [value(pin.outputs)], y: [pin.cost], colour: pin.colour });
    const here = value(judged.outputs);
    if (here !== null) series.push({ label: "present design", kind: "points", x: [here], y: [cost], note: "you are here", colour: "var(--accent)" });
    return {
      title: `Cost over ${name}, ${judged.units.toLocaleString("en-US")} units${line.length > 1 ? "; 256 along the line" : ""}`, x_label: `${name} [${own.unit}]`, y_label: `cost [${currency}]`, height: 260, series,
      vertical: limit === null ? [] : [[limit, `limit ${number(limit)} ${own.unit}`]], horizontal: [],
    };
  }
}
