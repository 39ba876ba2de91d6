// The list of zones and settings: a slider, a field and a lock for every group of sources.

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
const rounded = (value) => Number(value.toPrecision(4));

// What somebody typed, in a unit: decimal comma or point, a true minus, a unit behind it. Nothing where it may mean two
// numbers, as 1,000 may, or where its unit is not one of lengths and neither is the one that is asked for.
export function typed(text, unit = MICRO) {
  const found = /^\s*([-−+]?)(?![1-9]\d{0,2},\d{3}(?!\d))(\d+(?:[.,]\d*)?|[.,]\d+)(e[-+]?\d+)?\s*(µm|μm|um|mm)?\s*$/i.exec(text);
  if (!found) return NaN;
  const [, sign, digits, power = "", stated] = found, lengths = { [MICRO]: 1, mm: 1000 };
  const factor = stated ? (stated.toLowerCase() === "mm" ? lengths.mm : 1) / (lengths[unit] ?? NaN) : 1;
  return (sign === "-" || sign === "−" ? -1 : 1) * Number(digits.replace(",", ".") + power) * factor;
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
    this.build();
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
    const lower = Math.max(...members.map((own) => (own.lower / own.zone) * first.zone));
    const upper = Math.min(...members.map((own) => (own.upper / own.zone) * first.zone));
    const at = (place) => lower * (upper / lower) ** (place / STEPS);
    const place = (zone) => (STEPS * Math.log(zone / lower)) / Math.log(upper / lower);
    const name = many ? group : first.name;
    const set = (zone, settled) => {
      if (!(zone > 0) || !Number.isFinite(zone)) return this.show();
      const scale = zone / first.zone;
      for (const own of members) this.put(own.name, own === first ? zone : rounded(own.zone * scale));
      this.show();
      this.changed(this.design, settled);
    };
    const field = make("input", { inputmode: "decimal", "aria-label": `zone of ${name} in ${MICRO}`, onchange: (e) => set(typed(e.target.value), true) });
    const slider = make("input", {
      type: "range", min: 0, max: STEPS, step: 1, "aria-label": `zone of ${name}, from ${lower.toPrecision(3)} to ${upper.toPrecision(3)} ${MICRO}`,
      oninput: (e) => set(rounded(at(Number(e.target.value))), false), onchange: (e) => set(rounded(at(Number(e.target.value))), true),
    });
    const lock = make("button", { title: "lock: an allocation leaves it as it is", "aria-label": `lock ${name}`, onclick: () => this.toggle(group) });
    const price = make("span", { class: "price", title: "cost" });
    const share = make("div", { class: "share", hidden: true });
    const labels = [...new Set(members.map((own) => own.label).filter(Boolean))];
    const about = make("small", {}, [...labels, many ? `${members.length} alike: ${first.meaning}` : first.meaning].join(" · "));
    const row = make("div", { class: "row", onpointerenter: () => this.point(members.map((own) => own.name)), onpointerleave: () => this.point([]) },
      make("span", { class: "title" }, name, make("br"), about), make("span", {}, field, ` ${MICRO}`), lock, price,
      make("span", { class: "slide" }, slider, make("button", { title: "effect of this source over its zone", "aria-label": `effect of ${first.name}`, onclick: () => this.effect(first.name) }, "effect")), share);
    if (many) {
      const fields = members.map((own) => {
        const input = make("input", { inputmode: "decimal", "aria-label": `zone of ${own.name} in ${MICRO}`, onchange: (e) => {
          const zone = typed(e.target.value);
          if (zone > 0 && Number.isFinite(zone)) this.put(own.name, zone);
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
      field.value = rounded(zone);
      slider.value = Math.round(place(zone));
      const held = this.locked.has(group);
      lock.textContent = held ? "locked" : "lock";
      lock.setAttribute("aria-pressed", held);
      for (const input of [field, slider, ...(made ? [made] : []), ...(row.fields ?? []).map(([, own]) => own)]) input.disabled = held;
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
    this.rows.set(group, row);
    return row;
  }

  settingRow(own) {
    const fixed = own.lower >= own.upper, unit = /\[([^\]]*)\]$/.exec(own.name)?.[1] ?? "";
    const set = (value, settled) => {
      if (!Number.isFinite(value)) return this.show();
      this.design = { ...this.design, settings: { ...this.design.settings, [own.name]: Math.max(own.lower, Math.min(own.upper, value)) } };
      this.show();
      this.changed(this.design, settled);
    };
    const field = make("input", { inputmode: "decimal", disabled: fixed, "aria-label": own.name, onchange: (e) => set(typed(e.target.value, unit), true) });
    const slider = make("input", { type: "range", min: own.lower, max: own.upper, step: own.step || 1, disabled: fixed, "aria-label": `${own.name}, from ${own.lower} to ${own.upper}`,
      oninput: (e) => set(rounded(Number(e.target.value)), false), onchange: (e) => set(rounded(Number(e.target.value)), true) });
    const note = make("small", {}, fixed ? "as drawn: the study gives no bounds" : own.word);
    const row = make("div", { class: "row" }, make("span", { class: "title" }, own.name, make("br"), note), field, "", "", make("span", { class: "slide" }, slider));
    row.update = () => {
      field.value = rounded(this.setting(own.name));
      slider.value = this.setting(own.name);
    };
    this.rows.set(`setting ${own.name}`, row);
    return row;
  }

  put(name, zone) {
    const zones = { ...this.design.zones };
    if (zone === this.drawn[name]) delete zones[name];
    else zones[name] = zone;
    this.design = { ...this.design, zones };
  }

  toggle(group) {
    if (!this.locked.delete(group)) this.locked.add(group);
    this.show();
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
