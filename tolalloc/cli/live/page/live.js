// The live page: what a hand does becomes a design, a design becomes answers, a newer design calls off older ones.

import { Chart, colour, number } from "./chart.js";
import { CostChart } from "./cost.js";
import { Cursor } from "./cursor.js";
import { Designs } from "./designs.js";
import { Ghosts } from "./ghosts.js";
import { Picture } from "./picture.js";
import { Question } from "./question.js";
import { Refusal, ask, refusable, trouble } from "./requests.js";
import { named, percent, quantile, verdict } from "./verdict.js";
import { Zones, make } from "./zones.js";

const at = (id) => document.getElementById(id);
const REST = 350; // ms after which a hand rests and more units are asked for

let turn = 0, study, zones, designs, picture, question, cursor, costChart, drawn = null, judged = null, busy = false, waiting = false, resting = null, swept = null;
let shownState = "", judgedDesign = "", ranked = "", savedDesign = null, scaled = null, found = null, goodUnit = 1;
const history = { past: [], future: [], now: null };
const charts = new Map(), ghosts = new Ghosts();
const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);
const unit = () => Number(at("unit").value);
const state = (record = { design: zones.design, unit: unit() }) => JSON.stringify([record.design, record.unit]);
const TODAY = { name: "as drawn", design: { zones: {}, settings: {} }, colour: "var(--faint)" };

function draw(key, element, figure) {
  if (!charts.has(key)) {
    const place = make("div");
    element.append(make("figure", {}, make("figcaption", {}), place));
    charts.set(key, new Chart(place, figure));
  } else charts.get(key).update(figure);
  const caption = charts.get(key).element.parentElement.querySelector("figcaption");
  caption.textContent = `${figure.title}.`;
}

// Numbers that do not belong to the design and the unit that are set are greyed at once, and until theirs are there.
function belongs() {
  document.body.classList.toggle("moving", shownState !== state());
  const counting = judgedDesign !== JSON.stringify(zones.design);
  document.body.classList.toggle("counting", counting);
  at("answer").classList.toggle("stale", counting);
  question.belongs(zones.design);
  at("zones").classList.toggle("older", ranked !== "" && ranked !== JSON.stringify(zones.design));
  picture.belongs();
  const values = study.conditions.map(([name, value]) => [name, typeof value === "number" && name in zones.chosen ? zones.setting(name) : value]);
  at("conditions").textContent = [...values.map(([name, value]) => (name.endsWith("]") ? name.replace(/ ?\[(.*)\]$/, ` ${number(value)} $1`) : `${name} ${value}`)), `seed ${study.seed}`, ...study.limits].join(" · ");
}

// Price and curve at once; while one request is under way the newest design waits, and what older ones count is called off.
async function look() {
  belongs();
  if (busy) return void (waiting = true);
  busy = true;
  clearTimeout(resting);
  let record, refusal;
  try {
    do {
      waiting = false;
      record = { design: zones.design, unit: unit(), turn: ++turn };
      refusal = await answered(record);
    } while (waiting);
  } finally {
    busy = false;
  }
  if (refusal) return refused(record.design, refusal);
  if (await count(study.first, record)) resting = setTimeout(() => more(record), REST);
}

// Show what a design costs; where it is refused, return why.
async function answered(record) {
  try {
    drawn = await ask("design", record, true);
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    return error.message;
  }
  trouble("");
  zones.good = record.design;
  showDesign(record);
  return "";
}

// The row whose value was refused says why, and the last good design returns.
function refused(design, sentence) {
  if (!zones.good || same(zones.good, design)) return void trouble(sentence);
  if (same(history.past.at(-1), zones.good)) history.past.pop();
  history.now = zones.good;
  sessionStorage.setItem(kept(), JSON.stringify(zones.good));
  zones.refuse(sentence);
  buttons();
  return look();
}

// Return whether the units were counted and are still those of the design that is shown.
async function count(units, record) {
  const told = await refusable(ask("units", { ...record, units }));
  if (!told || told["called off"] || record.turn !== turn) return false;
  judged = told;
  judgedDesign = JSON.stringify(record.design);
  showUnits(record.turn);
  return true;
}

// More and more of the same units while the hand rests, then what stands behind them: ghosts, other limits, pinned designs.
async function more(record) {
  if (!(await count(Math.min(1024, study.most), record))) return;
  await caution(record);
  await picture.follow();
  await haunt(record);
  if (!(await count(study.most, record))) return;
  await caution(record);
  await scale(record);
  for (const own of designs.pinned) {
    if (own.units >= study.most || record.turn !== turn) continue;
    const told = await refusable(ask("units", { turn: record.turn, design: own.design, units: study.most }));
    if (!told || told["called off"]) return;
    designs.refine(own, told);
  }
}

// What a check says of the units that are counted: the same ones as the verdict's, so that no share stands there twice.
async function caution(record) {
  const said = await refusable(ask("examined", { ...record, units: judged.units }));
  if (said && record.turn === turn) at("cautions").replaceChildren(...said.sentences.map((text) => make("p", {}, text)));
}

// What stands behind curve and orders: the pinned designs, or the drawing.
const behind = () => (designs.pinned.length ? designs.pinned : zones.isDrawn ? [] : [TODAY]);

async function haunt(record) {
  const asked = async (design, own) => (record.turn === turn ? (await refusable(ask("design", { turn: record.turn, design, unit: own })))?.figures : null);
  if ((await ghosts.follow(behind(), record.unit, asked)) && record.turn === turn && !swept) curves(drawn.figures);
}

// What the drawing costs at other limits, at the settings that are shown.
async function scale(record) {
  const settings = JSON.stringify(record.design.settings);
  if (scaled?.settings === settings || record.turn !== turn) return;
  scaled = null;
  const told = await refusable(ask("scaled", { turn: record.turn, design: { zones: {}, settings: record.design.settings } }));
  if (!told?.designs) return;
  scaled = { settings, designs: told.designs };
  costChart.update();
}

function showDesign(record) {
  const change = drawn.cost - drawn.before;
  at("cost").textContent = drawn.cost.toFixed(2);
  at("cost-change").textContent = Math.abs(change) < 5e-4 ? `${study.currency}, as drawn` : `${study.currency}, ${change > 0 ? "+" : "−"}${Math.abs(change).toFixed(2)} to the drawing's ${drawn.before.toFixed(2)}`;
  zones.show(drawn);
  at("values").textContent = drawn.values.map((own) => `${own.name} ${own.value === null ? "without an answer" : `${number(own.value)} ${own.unit}`}`).join(" · ");
  unsweep();
  shownState = state(record);
  curves(drawn.figures);
  at("answer").classList.add("stale");
  belongs();
  at("answer").dataset.drawn = record.turn;
}

// Curve and orders, those of other designs behind them.
function curves(figures) {
  figures.forEach((figure, place) => {
    const series = [...ghosts.of(behind(), unit(), place), ...figure.series.map((own, k) => ({ ...own, colour: colour(k) }))];
    const shown = { ...figure, height: place ? 200 : 260, series };
    draw(`curve ${place}`, at(place ? "orders" : "curves"), shown);
    if (!place) cursor.show(charts.get("curve 0"), shown);
  });
}

function showUnits(shown) {
  const [share, low, high] = judged.yield;
  at("yield").textContent = percent(share);
  at("yield").classList.toggle("bad", high < judged.target);
  at("yield-interval").textContent = `${(100 * low).toFixed(2)} … ${percent(high)} (95 %)`;
  at("counted").textContent = `${judged.units.toLocaleString("en-US")} random units${judged.lost ? `, ${judged.lost} without an answer` : ""}`;
  for (const own of at("numbers").querySelectorAll(".quantile")) own.remove();
  at("numbers").append(...judged.outputs.flatMap((own) => own.quantiles.map((item) => quantile(own, item))));
  at("verdict").textContent = verdict(judged);
  at("verdict").className = `of-units${high < judged.target ? " bad" : ""}`;
  judged.outputs.forEach((own, place) => {
    const marks = [[own.upper, "limit"], [own.lower, "limit"], ...own.quantiles.map(({ share, value }) => [value, named(share)])].filter(([value]) => value !== null);
    draw(`units ${place}`, at("histograms"), {
      title: `${own.name} of ${judged.units.toLocaleString("en-US")} random units`, x_label: own.output, y_label: "share of the units [%]", height: 210,
      series: [{ label: "random units", kind: "histogram", ...own.histogram }], vertical: marks.map(([value, name]) => [value, `${name} ${number(Number(value.toPrecision(4)))} ${own.unit}`]), horizontal: [],
    });
  });
  for (const button of document.querySelectorAll("[data-unit]")) button.disabled = button.dataset.unit === "reject" && judged.outputs[0].reject === null;
  costChart.update();
  belongs();
  at("answer").dataset.judged = shown;
  at("answer").dataset.units = judged.units;
}

// A page that is loaded again goes on with its design.
const kept = () => `design of ${study.name}, ${study.model}`;

function remember(design) {
  sessionStorage.setItem(kept(), JSON.stringify(design));
  if (JSON.stringify(design) === JSON.stringify(history.now)) return;
  history.past.push(history.now);
  history.past = history.past.slice(-200);
  history.future = [];
  history.now = design;
  buttons();
}

function step(from, to) {
  if (!history[from].length) return;
  history[to].push(history.now);
  history.now = history[from].pop();
  zones.take(history.now);
  buttons();
  look();
}

function buttons() {
  at("undo").disabled = !history.past.length;
  at("redo").disabled = !history.future.length;
}

function take(design) {
  zones.take(design);
  remember(design);
  look();
}

async function pin() {
  const { dataset } = at("answer"); // cost and yield must be those of one design
  for (let tries = 0; dataset.judged !== dataset.drawn && tries < 200; tries++) await new Promise((done) => setTimeout(done, 50));
  if (!judged || dataset.judged !== dataset.drawn) return;
  const values = Object.fromEntries([...zones.groups].map(([group, members]) => [`${group} [µm]`, zones.zone(members[0].name)]));
  for (const own of study.settings) values[own.name] = zones.setting(own.name);
  ghosts.known.set(ghosts.key(zones, unit()), drawn.figures);
  designs.pin({ units: judged.units, design: zones.design, cost: drawn.cost, yield: judged.yield, outputs: judged.outputs, values });
}

// One error of the unit goes over its zone; curve and orders follow a slider.
async function effect(source) {
  while (busy) await new Promise((done) => setTimeout(done, 20)); // a design under way would end it at once
  const record = { design: zones.design, unit: Number(at("unit").value), source };
  const found = await refusable(ask("sweep", record));
  if (!found) return;
  swept = found;
  at("effect").hidden = false;
  at("effect-source").textContent = source;
  draw("effect", at("effect-chart"), { ...found.figure, height: 220 });
  at("effect-share").value = 4;
  follow();
  at("effect").scrollIntoView({ block: "nearest" });
  at("effect-share").focus({ preventScroll: true });
}

function follow() {
  const place = Number(at("effect-share").value), { x, y } = swept.figure.series[0];
  at("effect-at").textContent = `at ${(100 * x[place]).toFixed(0)} % of its half zone: ${number(y[place])} ${judged?.outputs[0].unit ?? ""}`;
  charts.get("effect").update({ ...swept.figure, height: 220, vertical: [[x[place], "here"]] });
  curves(swept.curves[place]);
  picture.follow();
}

function unsweep() {
  swept = null;
  at("effect").hidden = true;
}

function unlocked(found) {
  const kept = Object.fromEntries(Object.entries(found).filter(([name]) => !zones.locked.has(study.sources.find((own) => own.name === name)?.group)));
  return Object.fromEntries(Object.entries(kept).filter(([name, zone]) => zone !== zones.drawn[name]));
}

// What a question found of a design: what drives it shades rows and picture, a cheapest drawing stands in the chart of cost.
function tookAnswer(answer, design) {
  if (answer.shares) {
    ranked = JSON.stringify(design);
    zones.show(null, answer.shares);
    picture.shade();
  }
  if (answer.front) found = { front: answer.front };
  costChart.update();
  belongs();
}

function refuseUnit(sentence) {
  at("unit").setAttribute("aria-invalid", Boolean(sentence));
  at("unit-refused").hidden = !sentence;
  at("unit-refused").textContent = sentence;
}

// Pinned designs are kept for a page that is loaded again; ghosts and the chart of cost follow them.
function pinsChanged() {
  sessionStorage.setItem(`pinned ${kept()}`, JSON.stringify(designs.pinned));
  costChart.update();
  if (drawn && !swept) curves(drawn.figures);
}

// Those that the drawing still knows, at what they cost now.
async function restorePins() {
  const known = [];
  for (const own of JSON.parse(sessionStorage.getItem(`pinned ${kept()}`) ?? "[]")) {
    try {
      const { cost } = await ask("design", { turn, design: own.design }, true);
      known.push({ ...own, cost, units: 0 });
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  }
  if (known.length) designs.restore(known);
}

// A design that was neither drawn nor saved is lost with the page.
const unsaved = () => !zones.isDrawn && JSON.stringify(zones.design) !== savedDesign;

async function save() {
  at("saving-error").hidden = true;
  at("saving-name").value ||= `${study.name.replace(/\W/g, "_")}_live`;
  at("saving").showModal();
}

async function saved(event) {
  event.preventDefault();
  try {
    const { design } = zones, told = await ask("save", { design, name: at("saving-name").value }, true);
    at("saving").close();
    savedDesign = JSON.stringify(design);
    sessionStorage.setItem(`saved ${kept()}`, savedDesign);
    at("saved").replaceChildren(`Saved as ${told.script} with ${told.table}. To confirm it, paste into a terminal: `, make("code", {}, told.command));
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    at("saving-error").hidden = false;
    at("saving-error").textContent = error.message;
  }
}

async function begin() {
  study = await ask("study");
  document.title = `${study.name}, live`;
  at("name").textContent = `${study.model}: ${study.name}`;
  at("currency").textContent = study.currency;
  designs = new Designs(at("designs"), { currency: study.currency, take: (own) => take(own.design), changed: pinsChanged });
  zones = new Zones(study, at("zones"), at("settings"), {
    changed: (design, settled) => {
      if (settled) remember(design);
      look();
    },
    effect,
    point: (names) => picture.light(names),
  });
  picture = new Picture(study, zones, () => {
    const record = { design: zones.design, unit: unit() };
    return swept ? { ...record, source: swept.source, share: swept.figure.series[0].x[at("effect-share").value] } : record;
  }, { onTurn: (angle) => cursor.mark(angle), errorAt: (angle) => cursor.valueAt(angle) });
  cursor = new Cursor({ turned: (angle) => picture.turnTo(angle), pointed: (angle) => picture.runs || picture.turnTo(angle) });
  costChart = new CostChart(at("cost-choice"), () => ({ judged, cost: drawn?.cost, currency: study.currency, pins: designs.pinned, scaled: scaled?.designs, found, byProcess: study.sources.some((own) => own.processes.length) }), (figure) => draw("costs", at("costs"), figure));
  question = new Question({
    asked: () => ({ design: zones.design, locked: study.sources.filter((own) => zones.locked.has(own.group)).map((own) => own.name) }),
    answered: tookAnswer,
    draw: (figure) => {
      charts.delete("found");
      draw("found", at("found"), figure);
    },
    take: (zoned, settings) => {
      const design = { zones: unlocked(zoned), settings: { ...zones.design.settings, ...settings } };
      take(design);
      return design;
    },
  });
  history.now = zones.design;
  at("unit").max = study.most;
  at("unit").addEventListener("change", () => {
    const wanted = at("unit").value, good = /^\d+$/.test(wanted) && Number(wanted) <= study.most;
    refuseUnit(good ? "" : `“${wanted}” is not a unit: write a whole number up to ${number(study.most)}, 0 for exact parts.`);
    at("unit").value = good ? wanted : goodUnit;
    goodUnit = unit();
    if (good) look();
  });
  for (const button of document.querySelectorAll("[data-unit]"))
    button.addEventListener("click", () => {
      at("unit").value = button.dataset.unit === "exact" ? 0 : judged?.outputs[0][button.dataset.unit] ?? 1;
      goodUnit = unit();
      refuseUnit("");
      look();
    });
  at("search").addEventListener("input", (event) => zones.find(event.target.value));
  at("undo").addEventListener("click", () => step("past", "future"));
  at("redo").addEventListener("click", () => step("future", "past"));
  at("reset").addEventListener("click", () => take({ zones: {}, settings: {} }));
  at("pin").addEventListener("click", pin);
  at("save").addEventListener("click", save);
  at("saving").addEventListener("submit", saved);
  at("saving-cancel").addEventListener("click", () => at("saving").close());
  at("effect-share").addEventListener("input", follow);
  const narrow = matchMedia("(max-width: 900px)");
  at("moving").open = !narrow.matches; // zones would stand far below it
  const place = () => (narrow.matches ? at("zones-panel").before(at("pictures")) : at("zones-panel").after(at("pictures"))); // tabs go as the eye does
  narrow.addEventListener("change", place);
  place();
  // Cost and yield, where the answer itself has scrolled away.
  const mirror = () => at("bar").replaceChildren(...["cost", "yield"].map((name) => Object.assign(document.createElement("span"), { className: at(name).className, textContent: `${name} ${at(name).textContent}` })));
  new MutationObserver(mirror).observe(at("numbers"), { subtree: true, childList: true, characterData: true });
  new IntersectionObserver(([seen]) => (at("bar").hidden = seen.isIntersecting)).observe(at("answer"));
  mirror();
  addEventListener("beforeunload", (event) => unsaved() && event.preventDefault());
  at("moving").addEventListener("toggle", () => judged && picture.follow());
  at("effect-close").addEventListener("click", () => {
    unsweep();
    curves(drawn.figures);
    picture.follow();
  });
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("input:not([type=range])")) return;
    const key = event.key.toLowerCase(), forth = key === "y" || (key === "z" && event.shiftKey);
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    step(...(forth ? ["future", "past"] : ["past", "future"]));
  });
  const last = JSON.parse(sessionStorage.getItem(kept()) ?? "null");
  if (last && study.sources.length) history.now = last;
  savedDesign = sessionStorage.getItem(`saved ${kept()}`);
  await restorePins();
  zones.take(history.now);
  buttons();
  await look();
  if (!drawn) take({ zones: {}, settings: {} }); // what was kept is of another drawing
  document.body.dataset.ready = "yes";
}

begin();
