// The list of zones and settings: a slider, a field and a lock for every group of sources.

import { number } from "./chart.js";

export const MICRO = "µm";

function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes))
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null) made.setAttribute(key, value);
  made.append(...children);
  return made;
}
export { make };

const STEPS = 400; // of a slider
const THUMB = 16; // width of the handle of a slider [px]
const rounded = (value) => Number(value.toPrecision(4));
const fine = (value) => Number(value.toPrecision(7)); // of what follows by a ratio, which many moves shall not wear off

// A change as a reader writes it: its sign, its amount, and its share of what is drawn.
export function change(now, drawn, unit) {
  const by = rounded(now) - rounded(drawn), sign = by < 0 ? "−" : "+";
  if (!by) return "as drawn";
  const share = drawn > 0 ? ` (${sign}${number(rounded(Math.abs(100 * (now / drawn - 1))).toPrecision(3) * 1)} %)` : "";
  return `${sign}${number(rounded(Math.abs(by)))} ${unit}${share}`;
}

// What somebody typed, in a unit: decimal comma or point, a true minus, a unit behind it. Nothing where it may mean two
// numbers, as 1,000 may, or where its unit is not one of lengths and neither is the one that is asked for.
export function typed(text, unit = MICRO) {
  const found = /^\s*([-−+]?)(?![1-9]\d{0,2},\d{3}(?!\d))(\d+(?:[.,]\d*)?|[.,]\d+)(e[-+]?\d+)?\s*(µm|μm|um|mm)?\s*$/i.exec(text);
  if (!found) return NaN;
  const [, sign, digits, power = "", stated] = found, lengths = { [MICRO]: 1, mm: 1000 };
  const factor = stated ? (stated.toLowerCase() === "mm" ? lengths.mm : 1) / (lengths[unit] ?? NaN) : 1;
  return (sign === "-" || sign === "−" ? -1 : 1) * Number(digits.replace(",", ".") + power) * factor;
}

// A mark at a share of a slider.
function placed(mark, share) {
  mark.style.left = `calc(${THUMB / 2}px + (100% - ${THUMB}px) * ${Math.max(0, Math.min(1, share)).toFixed(4)})`;
}

export class Zones {
  // changed(design, settled) is called while a hand moves and once it rests; effect(source) asks for a sweep.
  constructor(study, element, settings, { changed, effect, point }) {
    Object.assign(this, { study, element, settings, changed, effect, point });
    this.drawn = Object.fromEntries(study.sources.map((own) => [own.name, own.zone]));
    this.chosen = Object.fromEntries(study.settings.map((own) => [own.name, own.value]));
    this.locked = new Set(study.sources.filter((own) => own.locked).map((own) => own.group));
    this.design = { zones: {}, settings: {} };
    this.groups = new Map();
    for (const own of study.sources) this.groups.set(own.group, [...(this.groups.get(own.group) ?? []), own]);
    this.rows = new Map();
    this.good = null; // the last design that the server accepted
    this.build();
  }

  get isDrawn() {
    return !Object.keys(this.design.zones).length && Object.entries(this.design.settings).every(([name, value]) => value === this.chosen[name]);
  }

  zone(name) {
    return this.design.zones[name] ?? this.drawn[name];
  }

  setting(name) {
    return this.design.settings[name] ?? this.chosen[name];
  }

  build() {
    this.element.replaceChildren(...[...this.groups].map(([group, members]) => this.row(group, members)));
    this.settings.replaceChildren(...this.study.settings.map((own) => this.settingRow(own)));
  }

  row(group, members) {
    const [first] = members, many = members.length > 1;
    // The ends of the slider: as far as all members go at the ratio in which they stand, or else the first one alone.
    const ends = () => {
      const shares = members.map((own) => this.zone(first.name) / this.zone(own.name));
      const low = Math.max(...members.map((own, k) => own.lower * shares[k])), high = Math.min(...members.map((own, k) => own.upper * shares[k]));
      return low < high ? [low, high] : [first.lower, first.upper];
    };
    let [lower, upper] = ends(), held = null; // zones of all members when the hand took hold of the slider
    const at = (place) => lower * (upper / lower) ** (place / STEPS);
    const place = (zone) => (STEPS * Math.log(zone / lower)) / Math.log(upper / lower);
    const name = many ? group : first.name;
    const set = (zone, settled) => {
      held ??= members.map((own) => this.zone(own.name));
      members.forEach((own, k) => this.put(own.name, k ? fine((held[k] * zone) / held[0]) : zone));
      if (settled) held = null;
      this.accept();
      this.show();
      this.changed(this.design, settled);
    };
    const read = (text) => {
      const zone = typed(text);
      if (zone > 0 && Number.isFinite(zone)) return zone;
      row.refuse(`“${text}” is not a zone: write a number above 0, such as 4 or 0.004 mm.`);
      return null;
    };
    const field = make("input", { inputmode: "decimal", "aria-label": `zone of ${name} in ${MICRO}`, onchange: (e) => {
      const zone = read(e.target.value);
      if (zone === null) this.show();
      else set(zone, true);
    } });
    const slider = make("input", {
      type: "range", min: 0, max: STEPS, step: 1, "aria-label": `zone of ${name}`,
      oninput: (e) => set(rounded(at(Number(e.target.value))), false), onchange: (e) => set(rounded(at(Number(e.target.value))), true),
    });
    const lock = make("button", { title: "lock: an allocation does not change it", onclick: () => this.toggle(group) });
    const price = make("span", { class: "price of-design", title: "cost" }), delta = make("small", { class: "delta" });
    const drawn = make("i", { class: "drawn", title: `drawing: ${number(rounded(first.zone))} ${MICRO}` });
    const share = make("div", { class: "share", hidden: true });
    const labels = [...new Set(members.map((own) => own.label).filter(Boolean))];
    const about = make("small", {}, [...labels, many ? `${members.length} alike: ${first.meaning}` : first.meaning].join(" · "));
    const row = make("div", { class: "row", onpointerenter: () => this.point(members.map((own) => own.name)), onpointerleave: () => this.point([]) },
      make("span", { class: "title" }, name, make("br"), about), make("span", {}, field, ` ${MICRO}`), lock, price, delta,
      make("span", { class: "slide" }, make("span", { class: "track" }, slider, drawn), make("button", { title: "effect of this source over its zone", "aria-label": `effect of ${first.name}`, onclick: () => this.effect(first.name) }, "effect")), share);
    if (many) {
      const fields = members.map((own) => {
        const input = make("input", { inputmode: "decimal", "aria-label": `zone of ${own.name} in ${MICRO}`, onchange: (e) => {
          const zone = read(e.target.value);
          if (zone === null) return this.show();
          this.put(own.name, zone);
          this.accept();
          this.show();
          this.changed(this.design, true);
        } });
        return [own, input];
      });
      row.append(make("details", {}, make("summary", {}, "each"), ...fields.map(([own, input]) => make("label", {}, own.label ? `${own.name} (${own.label})` : own.name, input))));
      row.fields = fields;
    }
    const made = first.processes.length > 1 ? make("select", { "aria-label": `process of ${name}`, onchange: (e) => {
      const [, least, most] = first.processes[e.target.value];
      set(rounded(Math.min(Math.max(this.zone(first.name), least * 1.0001), most * 0.9999)), true);
    } }, ...first.processes.map(([process, least, most], place) => make("option", { value: place }, `${process}, ${rounded(least)} to ${rounded(most)} ${MICRO}`))) : null;
    if (made) row.insertBefore(make("label", { class: "process" }, "cheapest by ", made), share);
    Object.assign(row, { update: (costs, shares, by) => {
      const zone = this.zone(first.name);
      if (held === null) [lower, upper] = ends(); // they stay while the hand holds the slider
      slider.setAttribute("aria-valuetext", `${number(rounded(zone))} ${MICRO}, from ${lower.toPrecision(3)} to ${upper.toPrecision(3)}`);
      placed(drawn, place(first.zone) / STEPS);
      const alike = members.every((own) => Math.abs(this.zone(own.name) / own.zone / (zone / first.zone) - 1) < 1e-3);
      delta.textContent = alike ? change(zone, first.zone, MICRO) : "members differ";
      field.value = rounded(zone);
      slider.value = Math.round(place(zone));
      const locked = this.locked.has(group);
      lock.textContent = locked ? "locked" : "lock";
      lock.setAttribute("aria-label", `${lock.textContent} ${name}`);
      lock.setAttribute("aria-pressed", locked);
      for (const input of [field, slider, ...(made ? [made] : []), ...(row.fields ?? []).map(([, own]) => own)]) input.disabled = locked;
      (row.fields ?? []).forEach(([own, input]) => (input.value = rounded(this.zone(own.name))));
      if (made && by) made.selectedIndex = first.processes.findIndex(([process]) => process === by[first.name]);
      if (costs) price.textContent = members.reduce((sum, own) => sum + costs[own.name], 0).toFixed(2);
      if (shares) {
        const own = members.reduce((sum, member) => sum + (shares[member.name] ?? 0), 0);
        share.hidden = false;
        share.style.width = `${Math.min(own, 100)}%`;
        share.title = `${own.toFixed(1)} % of the sum of all total indices`;
      }
    } });
    this.refusable(row, [field, ...(row.fields ?? []).map(([, own]) => own)]);
    this.rows.set(group, row);
    return row;
  }

  settingRow(own) {
    const fixed = own.lower >= own.upper, unit = /\[([^\]]*)\]$/.exec(own.name)?.[1] ?? "";
    const set = (value, settled) => {
      this.design = { ...this.design, settings: { ...this.design.settings, [own.name]: value } };
      this.accept();
      this.show();
      this.changed(this.design, settled);
    };
    const field = make("input", { inputmode: "decimal", disabled: fixed, "aria-label": own.name, onchange: (e) => {
      const value = typed(e.target.value, unit);
      if (Number.isFinite(value) && value >= own.lower && value <= own.upper) return set(value, true);
      row.refuse(`“${e.target.value}” is not allowed: write a number from ${number(own.lower)} to ${number(own.upper)}.`);
      this.show();
    } });
    const delta = make("small", { class: "delta" }), drawn = make("i", { class: "drawn", hidden: fixed, title: `study: ${number(own.value)} ${unit}` });
    const slider = make("input", { type: "range", min: own.lower, max: own.upper, step: own.step || 1, disabled: fixed, "aria-label": `${own.name}, from ${number(own.lower)} to ${number(own.upper)}`,
      oninput: (e) => set(rounded(Number(e.target.value)), false), onchange: (e) => set(rounded(Number(e.target.value)), true) });
    const note = make("small", {}, fixed ? "as drawn: the study gives no bounds" : own.word);
    const row = make("div", { class: "row" }, make("span", { class: "title" }, own.name, make("br"), note), make("span", { class: "alone" }, field), delta, make("span", { class: "slide" }, make("span", { class: "track" }, slider, drawn)));
    this.refusable(row, [field]);
    row.update = () => {
      placed(drawn, (own.value - own.lower) / (own.upper - own.lower || 1));
      delta.textContent = fixed ? "" : change(this.setting(own.name), own.value, unit);
      field.value = rounded(this.setting(own.name));
      slider.value = this.setting(own.name);
    };
    this.rows.set(`setting ${own.name}`, row);
    return row;
  }

  put(name, zone) {
    const zones = { ...this.design.zones };
    if (Math.abs(zone - this.drawn[name]) <= 1e-6 * this.drawn[name]) delete zones[name];
    else zones[name] = zone;
    this.design = { ...this.design, zones };
  }

  toggle(group) {
    if (!this.locked.delete(group)) this.locked.add(group);
    this.show();
  }

  // A row says why a value was refused, it alone, until something else is accepted.
  refusable(row, fields) {
    const sentence = make("p", { class: "refusal", role: "alert", hidden: true });
    row.append(sentence);
    row.mark = (text) => {
      row.classList.toggle("refused", Boolean(text));
      sentence.hidden = !text;
      sentence.textContent = text;
      for (const own of fields) own.setAttribute("aria-invalid", Boolean(text));
    };
    row.refuse = (text) => {
      this.accept();
      row.mark(text);
    };
  }

  // No row is marked any more: something else was accepted, or refused.
  accept() {
    for (const row of this.rows.values()) row.mark("");
  }

  // Design and rows that a server refused: they alone are marked, and the last good values return.
  refuse(sentence) {
    const { design, good } = this;
    const changed = [...this.rows].filter(([key]) => (key.startsWith("setting ") ? design.settings[key.slice(8)] !== good.settings[key.slice(8)]
      : this.groups.get(key).some(({ name }) => design.zones[name] !== good.zones[name])));
    this.accept();
    for (const [, row] of changed) row.mark(sentence);
    this.take(good);
  }

  // Take over a whole design: an earlier one, a pinned one, or what an allocation found.
  take(design) {
    this.design = design;
    this.show();
  }

  // drawn is what a design costs; shares are what a ranking said.
  show(drawn = null, shares = null) {
    this.drawnCosts = drawn ?? this.drawnCosts;
    this.shares = shares ?? this.shares;
    for (const row of this.rows.values()) row.update(this.drawnCosts?.costs, this.shares, this.drawnCosts?.made);
  }

  find(text) {
    for (const [group, row] of this.rows) {
      const names = [group, ...(this.groups.get(group) ?? []).flatMap((own) => [own.name, own.label])];
      row.hidden = !names.some((name) => name.toLowerCase().includes(text.toLowerCase()));
    }
  }

  light(names) {
    for (const [group, row] of this.rows) row.classList.toggle("lit", (this.groups.get(group) ?? []).some((own) => names.includes(own.name)));
  }
}
