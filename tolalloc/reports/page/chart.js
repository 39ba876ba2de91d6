// Charts of a report and of the live page: SVG that prints, tells its values under the pointer, and needs no library.

const SVG = "http://www.w3.org/2000/svg";
const COLOURS = ["#1f4e79", "#d9822b", "#3a8f5c", "#8c3b7a", "#7f7f7f", "#b8a100", "#17a2b8", "#c0392b", "#6a4fc3"];
const LETTER = 6.6; // width of a letter at 12 px, on average
const pen = document.createElement("canvas").getContext("2d");
pen.font = '12px system-ui, "Segoe UI", sans-serif';
const wide = (text) => pen.measureText(text).width;
const TURNED = 0.755, TURNED_DARK = 0.62; // shares of a cell's colour from which its number is light, or dark on a dark page
const ROW = 15; // height of a line of names above a chart
const BAR = 12; // height of a bar with the gap below it
const NARROW = 520; // below, names of bars that take more than two fifths stand above them

export const colour = (number) => `var(--series-${number % COLOURS.length}, ${COLOURS[number % COLOURS.length]})`;

export function node(name, attributes = {}, text = null) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  return made;
}

// A number as the reports write it: five significant digits at most, a true minus.
export function number(value) {
  if (value === null || !Number.isFinite(value)) return "–";
  const text = Math.abs(value) >= 1e4 ? value.toFixed(0) : String(Number(value.toPrecision(5)));
  return text.replace(/^-/, "−");
}

// The value of a line at a place between its points, straight from one to the next.
export function valueAt({ x, y }, at) {
  const after = x.findIndex((value) => value >= at), k = Math.max(after < 0 ? x.length - 1 : after, 1);
  if (x.length < 2 || y[k] === null || y[k - 1] === null) return null;
  const share = Math.max(0, Math.min(1, (at - x[k - 1]) / (x[k] - x[k - 1] || 1)));
  return y[k - 1] + share * (y[k] - y[k - 1]);
}

function range(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value === null || !Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return [0, 1];
  return low === high ? [low - 0.5 || -0.5, high + 0.5] : [low, high];
}

// An axis: where a value stands, and its ticks.
class Axis {
  constructor(low, high, from, to, logarithmic = false) {
    Object.assign(this, { low, high, from, to, logarithmic });
  }
  at(value) {
    const of = this.logarithmic ? (v) => Math.log10(Math.max(v, 1e-300)) : (v) => v;
    const share = (of(value) - of(this.low)) / (of(this.high) - of(this.low));
    return this.from + share * (this.to - this.from);
  }
  value(place) {
    const share = (place - this.from) / (this.to - this.from);
    if (!this.logarithmic) return this.low + share * (this.high - this.low);
    return this.low * (this.high / this.low) ** share;
  }
  ticks(most) {
    if (this.logarithmic) {
      const found = [], steps = Math.log10(this.high / this.low) > 2 ? [1] : [1, 2, 5];
      for (let power = Math.floor(Math.log10(this.low)); power <= Math.ceil(Math.log10(this.high)); power++)
        for (const step of steps) {
          const value = step * 10 ** power;
          if (value >= this.low * 0.999 && value <= this.high * 1.001) found.push(value);
        }
      return found;
    }
    const rough = (this.high - this.low) / Math.max(most, 2);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((s) => s * power).find((s) => s >= rough);
    const found = [];
    for (let k = Math.ceil(this.low / step - 1e-9); k * step <= this.high + 1e-9 * step; k++)
      found.push(Math.abs(k) < 1e-12 ? 0 : Number((k * step).toPrecision(12)));
    return found;
  }
}

// Values of all series on an axis, and those that are marked on it.
function extent(figure, axis) {
  const marks = (axis === "x" ? figure.vertical : figure.horizontal) ?? [];
  const found = marks.map(([value]) => value);
  for (const item of figure.series) {
    const own = axis === "x" ? item.x : [...item.y, ...(item.low ?? []), ...(item.high ?? [])];
    found.push(...own);
    if (axis === "x" && item.kind === "histogram") found.push(item.x[item.x.length - 1] + item.width);
    if (axis === "y" && ["stems", "histogram"].includes(item.kind)) found.push(0);
  }
  return found;
}

function padded([low, high], share, logarithmic) {
  if (logarithmic) {
    const factor = (high / low) ** share;
    return [low / factor, high * factor];
  }
  const pad = share * (high - low);
  return [low === 0 ? 0 : low - pad, high === 0 ? 0 : high + pad];
}

// Rows above a chart in which the names of its vertical marks stand, so that no name meets a bar, an axis or the line of
// another mark: of all orders and sides the one with the fewest crossings, then the fewest rows.
function named(marks, x, from, to) {
  const shown = marks.filter(([value, name]) => name && value >= x.low && value <= x.high).map(([value, name]) => ({ name, at: x.at(value), wide: wide(name) + 6 }));
  if (shown.length > 4) return { labels: [], rows: 0 };
  const orders = (items) => (items.length < 2 ? [items] : items.flatMap((own, k) => orders(items.filter((_, other) => other !== k)).map((rest) => [own, ...rest])));
  let best = { worth: Infinity, labels: [], rows: 0 };
  for (const order of orders(shown))
    for (let sides = 0; sides < 3 ** order.length; sides++) {
      const labels = [];
      let worth = 0;
      for (let k = 0; k < order.length && worth < best.worth; k++) {
        const own = order[k];
        const side = ["start", "end", "middle"][Math.floor(sides / 3 ** k) % 3], middle = side === "middle"; // over its mark where neither side has room
        const low = middle ? Math.max(from, Math.min(to - own.wide, own.at - own.wide / 2)) : side === "end" ? own.at - own.wide : own.at, high = low + own.wide;
        if (middle) worth += 0.5;
        if (low < from) worth += from - low;
        if (high > to) worth += high - to;
        const meets = (other) => low < other.high + 8 && other.low < high + 8;
        let row = 0;
        for (const other of labels) if (meets(other)) row = Math.max(row, other.row + 1);
        for (const other of labels) if (other.row < row && own.at > other.low - 3 && own.at < other.high + 3 && own.at !== other.at) worth += 30;
        labels.push({ ...own, side, low, high, row });
      }
      if (labels.length < order.length) continue;
      const rows = Math.max(0, ...labels.map((own) => own.row + 1));
      if (worth + rows < best.worth) best = { worth: worth + rows, labels, rows };
    }
  return best;
}

export class Chart {
  // The figure is a record of `tolalloc.reports.charts.chart`.
  constructor(element, figure) {
    this.element = element;
    element.classList.add("chart");
    this.zoom = null;
    this.cursor = null; // a value of x that is marked
    this.onCursor = null; // called with the value of x under the pointer
    this.tip = document.createElement("div");
    this.tip.className = "tip";
    this.tip.hidden = true;
    this.update(figure);
    new ResizeObserver(() => {
      if (!this.onPaper && Math.abs(element.clientWidth - this.width) >= 1) this.draw();
    }).observe(element);
  }

  update(figure) {
    this.figure = figure;
    this.draw(this.width); // its place says when it has another width: asking for it lays the page out once more
  }

  // Paper is as wide as it is, whatever the screen was: a chart that is only made smaller cannot be read.
  draw(width) {
    this.width = Math.max((width ?? this.element.clientWidth) || 720, 240);
    const bars = this.figure.series?.some((item) => item.kind === "bars");
    const drawn = this.figure.values ? this.heat() : bars ? this.bars() : this.plane();
    drawn.setAttribute("role", "img");
    drawn.setAttribute("aria-label", this.figure.title);
    // A chart that is wider than its place is scrolled, by the keyboard too.
    if (Number(drawn.getAttribute("width")) > this.width) this.element.tabIndex = 0;
    else this.element.removeAttribute("tabindex");
    this.element.replaceChildren(this.legend(), drawn, this.tip);
  }

  print(width) {
    this.onPaper = true;
    this.draw(width);
  }

  show() {
    this.onPaper = false;
    this.draw();
  }

  legend() {
    const list = document.createElement("div");
    list.className = "legend";
    const series = this.figure.series ?? [];
    if (series.length > 1 || (this.figure.vertical ?? []).length || (this.figure.horizontal ?? []).length)
      series.forEach((item, place) => {
        const entry = document.createElement("span");
        const box = document.createElement("i");
        box.style.background = item.colour ?? colour(place);
        entry.append(box, item.label);
        list.append(entry);
      });
    return list;
  }

  canvas(height, width = this.width) {
    return node("svg", { viewBox: `0 0 ${width} ${height}`, width, height });
  }

  plane() {
    const { figure } = this, height = figure.height ?? Math.max(150, Math.min(380, 0.46 * this.width));
    const svg = this.canvas(height);
    let [xl, xh] = this.zoom ?? padded(range(extent(figure, "x")), 0.02, figure.logarithmic_x);
    const positive = (values, logarithmic) => (logarithmic ? values.filter((value) => value > 0) : values);
    let [yl, yh] = padded(range(positive(extent(figure, "y"), figure.logarithmic)), 0.05, figure.logarithmic);
    const left = LETTER * Math.max(...new Axis(yl, yh, 1, 0, figure.logarithmic).ticks(5).map((v) => number(v).length), 3) + 16;
    const right = 12, bottom = 44, above = named(figure.vertical ?? [], new Axis(xl, xh, left, this.width - right, figure.logarithmic_x), 2, this.width - 2);
    const top = 24 + ROW * above.rows;
    if (figure.equal) {
      const per = Math.max((xh - xl) / (this.width - left - right), (yh - yl) / (height - top - bottom));
      const wide = (per * (this.width - left - right) - (xh - xl)) / 2, tall = (per * (height - top - bottom) - (yh - yl)) / 2;
      [xl, xh, yl, yh] = [xl - wide, xh + wide, yl - tall, yh + tall];
    }
    const x = new Axis(xl, xh, left, this.width - right, figure.logarithmic_x);
    const y = new Axis(yl, yh, height - bottom, top, figure.logarithmic);
    this.frame(svg, x, y, { left, right, top, bottom, height });
    const clip = `clip-${(Chart.count = (Chart.count ?? 0) + 1)}`;
    const area = node("clipPath", { id: clip });
    area.append(node("rect", { x: left, y: top, width: this.width - left - right, height: height - top - bottom }));
    const inside = node("g", { "clip-path": `url(#${clip})` });
    svg.append(area, inside);
    figure.series.forEach((item, place) => this.series(inside, item, place, x, y));
    this.marks(svg, x, y, { left, right, top, bottom, height, above });
    this.marker = node("g", { class: "cursor" });
    this.axes = { x, y, top, bottom: height - bottom };
    svg.append(this.marker);
    this.mark(this.cursor);
    if (figure.series.some((item) => item.kind === "line")) this.zooming(svg, x, top, height - bottom);
    svg.addEventListener("pointermove", (event) => this.point(event, svg, x, y));
    svg.addEventListener("pointerleave", () => (this.tip.hidden = true));
    return svg;
  }

  frame(svg, x, y, { left, right, top, bottom, height }) {
    const { figure } = this;
    for (const value of y.ticks(5)) {
      svg.append(node("line", { class: "grid", x1: left, x2: this.width - right, y1: y.at(value), y2: y.at(value) }));
      svg.append(node("text", { class: "tick", x: left - 6, y: y.at(value) + 4, "text-anchor": "end" }, number(value)));
    }
    for (const value of x.ticks(Math.max(3, this.width / 110))) {
      svg.append(node("line", { class: "grid", x1: x.at(value), x2: x.at(value), y1: top, y2: height - bottom }));
      svg.append(node("text", { class: "tick", x: x.at(value), y: height - bottom + 16, "text-anchor": "middle" }, number(value)));
    }
    this.below(svg, (left + this.width - right) / 2, height - 8, figure.x_label ?? "");
    svg.append(node("text", { class: "label", x: 4, y: 12 }, figure.y_label ?? "")); // above its axis, where it is read without turning
  }

  // The name of an axis, no farther out than the chart, and a little smaller where it is longer.
  below(svg, middle, y, text) {
    const half = Math.min(wide(text), this.width - 4) / 2, x = Math.max(half + 2, Math.min(this.width - half - 2, middle));
    const label = node("text", { class: "label", x, y, "text-anchor": "middle" }, text);
    if (wide(text) > this.width - 4) Object.entries({ textLength: this.width - 4, lengthAdjust: "spacingAndGlyphs" }).forEach(([key, value]) => label.setAttribute(key, value));
    svg.append(label);
  }

  series(inside, item, place, x, y) {
    const paint = item.colour ?? colour(place), zero = y.at(Math.max(0, y.low));
    const path = (xs, ys) => {
      let text = "", open = false;
      xs.forEach((value, k) => {
        const known = ys[k] !== null && Number.isFinite(ys[k]);
        if (known) text += `${open ? "L" : "M"}${x.at(value).toFixed(2)} ${y.at(ys[k]).toFixed(2)}`;
        open = known;
      });
      return text;
    };
    if (item.ghost && item.kind === "stems") {
      const wide = Math.max(3, Math.min(6, 1.1 * (x.at(1) - x.at(0))));
      item.x.forEach((value, k) => {
        const tall = zero - y.at(item.y[k]);
        if (tall > 0) inside.append(node("rect", { class: "ghost", x: x.at(value) - wide / 2, y: zero - tall, width: wide, height: tall, fill: paint, opacity: 0.45 }));
      });
    } else if (item.kind === "line") {
      if (item.low?.length)
        inside.append(node("path", {
          d: `${path(item.x, item.high)}${path([...item.x].reverse(), [...item.low].reverse()).replace("M", "L")}Z`,
          fill: paint, opacity: 0.18,
        }));
      inside.append(node("path", { d: path(item.x, item.y), fill: "none", stroke: paint, "stroke-width": item.ghost ? 1 : 1.6, opacity: item.ghost ? 0.6 : 1 }));
    } else if (item.kind === "points") {
      item.x.forEach((value, k) => {
        const dot = node("circle", { cx: x.at(value), cy: y.at(item.y[k]), r: 4.5, fill: paint });
        inside.append(dot);
        if (!item.note) return;
        // A name beside its point, on the side where it meets no mark and no edge.
        const at = x.at(item.x[k]), long = wide(item.note) + 16, marks = (this.figure.vertical ?? []).map(([mark]) => x.at(mark));
        const meets = (low, high) => (low < x.from || high > x.to) + marks.filter((mark) => mark > low && mark < high).length;
        const end = meets(at + 5, at + long) > meets(at - long, at - 5);
        inside.append(node("text", { class: "note", x: x.at(item.x[k]) + (end ? -9 : 9), y: y.at(item.y[k]) - 7, "text-anchor": end ? "end" : "start" }, item.note));
      });
    } else {
      const drawn = this.figure.series.filter((own) => !own.ghost), count = drawn.length, histogram = item.kind === "histogram";
      const wide = histogram ? Math.max(x.at(item.x[0] + item.width) - x.at(item.x[0]) - 0.6, 0.6) : Math.max(2, Math.min(10, 0.28 * (x.at(1) - x.at(0))));
      item.x.forEach((value, k) => {
        const tall = zero - y.at(item.y[k]);
        const shift = histogram ? 0 : (drawn.indexOf(item) - (count - 1) / 2) * wide - wide / 2;
        if (tall > 0) inside.append(node("rect", { x: x.at(value) + shift, y: zero - tall, width: wide, height: tall, fill: paint, opacity: histogram ? 0.55 : 1 }));
      });
    }
  }

  marks(svg, x, y, { left, right, top, bottom, height, above }) {
    for (const [value] of this.figure.vertical ?? [])
      if (value >= x.low && value <= x.high) svg.append(node("line", { class: "mark", x1: x.at(value), x2: x.at(value), y1: top, y2: height - bottom }));
    for (const { name, at, side, low, high, row } of above.labels) {
      svg.append(node("line", { class: "mark", x1: at, x2: at, y1: top - ROW * row - (side === "middle" ? 0 : 12), y2: top }));
      const place = { start: at + 5, end: at - 5, middle: (low + high) / 2 }[side];
      svg.append(node("text", { class: "mark", x: place, y: top - ROW * row - 3, "text-anchor": side }, name));
    }
    (this.figure.horizontal ?? []).forEach(([value, name]) => {
      if (value < y.low || value > y.high) return;
      svg.append(node("line", { class: "mark", x1: left, x2: this.width - right, y1: y.at(value), y2: y.at(value) }));
      svg.append(node("text", { class: "mark", x: this.width - right - 4, y: y.at(value) - 5, "text-anchor": "end" }, name));
    });
  }

  // Mark a value of x, as far as the chart shows it, on the line that is no ghost.
  mark(value) {
    this.cursor = value;
    if (!this.marker) return;
    const { x, y, top, bottom } = this.axes, own = this.figure.series.findLast((item) => !item.ghost && item.kind === "line");
    this.marker.replaceChildren();
    if (value === null || !own || value < x.low || value > x.high) return;
    const at = x.at(value), here = valueAt(own, value);
    this.marker.append(node("line", { x1: at, x2: at, y1: top, y2: bottom }));
    if (here !== null && here >= y.low && here <= y.high) this.marker.append(node("circle", { cx: at, cy: y.at(here), r: 4 }));
  }

  bars() {
    const { figure } = this, items = figure.series.filter((item) => item.kind === "bars");
    const names = items[0].x;
    const longest = Math.max(...names.map((name) => String(name).length), 4);
    const narrow = this.width < NARROW && 16 + LETTER * longest > 0.4 * this.width;
    const left = narrow ? 12 : Math.min(16 + LETTER * longest, 0.45 * this.width), right = 16;
    const row = (narrow ? 16 : 4) + BAR * items.length + 4;
    const values = items.flatMap((item) => [0, ...item.y, ...(item.low ?? []), ...(item.high ?? [])]);
    const marked = (figure.vertical ?? []).map(([value]) => value);
    const positive = figure.logarithmic_x ? values.filter((value) => value > 0) : [...values, ...marked];
    const [low, high] = padded(range(positive), 0.03, figure.logarithmic_x);
    const x = new Axis(low, high, left, this.width - right, figure.logarithmic_x);
    const above = named(figure.vertical ?? [], x, 2, this.width - 2), top = 8 + ROW * above.rows, height = top + row * names.length + 44;
    const svg = this.canvas(height);
    for (const value of x.ticks(Math.max(3, (this.width - left) / 110))) {
      svg.append(node("line", { class: "grid", x1: x.at(value), x2: x.at(value), y1: top, y2: height - 44 }));
      svg.append(node("text", { class: "tick", x: x.at(value), y: height - 28, "text-anchor": "middle" }, number(value)));
    }
    this.below(svg, (left + this.width - right) / 2, height - 8, figure.x_label ?? "");
    const zero = x.at(figure.logarithmic_x ? low : Math.max(low, Math.min(0, high)));
    names.forEach((name, place) => {
      const from = top + row * place + (narrow ? 16 : 2);
      svg.append(node("text", narrow ? { class: "tick", x: left, y: from - 4 } : { class: "tick", x: left - 6, y: from + (BAR * items.length) / 2 + 4, "text-anchor": "end" }, name));
      items.forEach((item, set) => {
        const end = x.at(item.y[place]), at = from + BAR * set;
        const bar = node("rect", { x: Math.min(zero, end), y: at + 1, width: Math.max(Math.abs(end - zero), 0.5), height: BAR - 2, fill: item.colour ?? colour(figure.series.indexOf(item)) });
        const text = `${name}, ${item.label}: ${number(item.y[place])}` + (item.low?.length ? ` (${number(item.low[place])}…${number(item.high[place])})` : "");
        this.tell(bar, text);
        svg.append(bar);
        if (item.low?.length) svg.append(node("path", { class: "interval", d: `M${x.at(item.low[place])} ${at + BAR / 2}H${x.at(item.high[place])}M${x.at(item.low[place])} ${at + BAR / 2 - 3}v6M${x.at(item.high[place])} ${at + BAR / 2 - 3}v6` }));
      });
    });
    this.marks(svg, x, new Axis(0, 1, height, 0), { left, right, top, bottom: 44, height, above });
    return svg;
  }

  heat() {
    const { figure } = this, longest = Math.max(...figure.rows.map((name) => name.length), 4);
    const left = 14 + LETTER * longest, cell = Math.max(38, Math.min(80, (this.width - left - 10) / figure.columns.length));
    const lines = figure.columns.map((name) => String(name).split("\n")), words = lines.flat().map((text) => text.length);
    const slanted = LETTER * Math.max(...words) > cell - 4; // names that are wider than their column
    const deep = slanted ? 0.72 * LETTER * Math.max(...figure.columns.map((name) => name.length)) + 8 : 18 * Math.max(...lines.map((own) => own.length));
    const width = left + cell * figure.columns.length + 10, tall = 22, height = tall * figure.rows.length + deep + 30;
    const svg = this.canvas(height, width), top = Math.max(...figure.values.flat().filter((value) => value !== null), 0) || 1;
    figure.rows.forEach((name, row) => {
      svg.append(node("text", { class: "tick", x: left - 6, y: tall * row + 15, "text-anchor": "end" }, name));
      figure.columns.forEach((column, place) => {
        const value = figure.values[row][place], share = Math.max(0, Math.min(1, (value ?? 0) / top));
        const box = node("rect", { class: "cell", x: left + cell * place, y: tall * row, width: cell - 1, height: tall - 1, "fill-opacity": share.toFixed(3) });
        this.tell(box, `${name}, ${figure.x_label} ${String(column).replace("\n", " ")}: ${number(value)} ${figure.label}`);
        svg.append(box);
        svg.append(node("text", { class: `cell${share > TURNED ? " turned" : ""}${share > TURNED_DARK ? " turned-dark" : ""}`, x: left + cell * (place + 0.5), y: tall * row + 15, "text-anchor": "middle" }, figure.texts[row][place]));
      });
    });
    const below = tall * figure.rows.length + 15;
    lines.forEach((own, place) => {
      const at = left + cell * (place + 0.5);
      if (slanted) svg.append(node("text", { class: "tick", x: at + 4, y: below - 4, "text-anchor": "end", transform: `rotate(-45 ${at + 4} ${below - 4})` }, own.join(" ")));
      else own.forEach((text, line) => svg.append(node("text", { class: "tick", x: at, y: below + 16 * line, "text-anchor": "middle" }, text)));
    });
    svg.append(node("text", { class: "label", x: left + (width - left) / 2, y: height - 6, "text-anchor": "middle" }, [figure.x_label, figure.label].filter(Boolean).join(" · ")));
    return svg;
  }

  tell(shape, text) {
    shape.append(node("title", {}, text));
  }

  point(event, svg, x, y) {
    const box = svg.getBoundingClientRect(), scale = this.width / box.width;
    const at = (event.clientX - box.left) * scale;
    if (at < x.from || at > x.to) return void (this.tip.hidden = true);
    this.onCursor?.(x.value(at));
    const rows = [], names = [];
    this.figure.series.forEach((item) => {
      if (!item.x.length) return;
      let nearest = 0;
      const middle = item.kind === "histogram" ? item.width / 2 : 0;
      item.x.forEach((value, k) => {
        if (Math.abs(x.at(value + middle) - at) < Math.abs(x.at(item.x[nearest] + middle) - at)) nearest = k;
      });
      const value = item.x[nearest];
      names.push(item.kind === "histogram" ? `${number(value)}…${number(value + item.width)}` : number(value));
      rows.push(`${item.label}: ${number(item.y[nearest])}` + (item.low?.length ? ` (${number(item.low[nearest])}…${number(item.high[nearest])})` : ""));
    });
    this.tip.textContent = [`${this.figure.x_label}: ${names[0]}`, ...rows].join("\n");
    this.tip.hidden = false;
    const place = (at / scale), over = place > box.width / 2;
    this.tip.style.left = over ? "" : `${place + 14}px`;
    this.tip.style.right = over ? `${box.width - place + 14}px` : "";
  }

  // Drag over a part of a curve to see it large; a double click shows all again.
  zooming(svg, x, top, bottom) {
    let start = null, band = null;
    const place = (event) => {
      const box = svg.getBoundingClientRect();
      return Math.max(x.from, Math.min(x.to, ((event.clientX - box.left) * this.width) / box.width));
    };
    svg.addEventListener("pointerdown", (event) => {
      start = place(event);
      band = node("rect", { class: "band", x: start, y: top, width: 0, height: bottom - top });
      svg.append(band);
    });
    svg.addEventListener("pointermove", (event) => {
      if (start === null) return;
      const now = place(event);
      band.setAttribute("x", Math.min(start, now));
      band.setAttribute("width", Math.abs(now - start));
    });
    svg.addEventListener("pointerup", (event) => {
      if (start === null) return;
      const ends = [x.value(Math.min(start, place(event))), x.value(Math.max(start, place(event)))];
      const wide = Math.abs(place(event) - start) > 8;
      band.remove();
      start = null;
      if (wide) {
        this.zoom = ends;
        this.draw();
      }
    });
    svg.addEventListener("dblclick", () => {
      this.zoom = null;
      this.draw();
    });
  }
}
