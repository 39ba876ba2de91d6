// The live page: what a hand does becomes a design, a design becomes answers, a newer design calls off older ones.

import { Chart, colour, number } from "./chart.js";
import { Designs } from "./designs.js";
import { Picture } from "./picture.js";
import { Refusal, ask, refusable, trouble } from "./requests.js";
import { named, percent, quantile, verdict } from "./verdict.js";
import { Zones, make } from "./zones.js";

const at = (id) => document.getElementById(id);
const REST = 350; // ms after which a hand rests and more units are asked for

let turn = 0, study, zones, designs, picture, drawn = null, judged = null, busy = false, waiting = false, resting = null, swept = null;
const history = { past: [], future: [], now: null };
const charts = new Map();

function draw(key, element, figure) {
  if (!charts.has(key)) {
    const place = make("div");
    element.append(make("figure", {}, make("figcaption", {}), place));
    charts.set(key, new Chart(place, figure));
  } else charts.get(key).update(figure);
  const caption = charts.get(key).element.parentElement.querySelector("figcaption");
  caption.textContent = `${figure.title}.`;
}

// Price and curve at once; while one request is under way the newest design waits, and what older ones count is called off.
async function look() {
  if (busy) return void (waiting = true);
  busy = true;
  clearTimeout(resting);
  let record;
  try {
    do {
      waiting = false;
      record = { design: zones.design, unit: Number(at("unit").value), turn: ++turn };
      drawn = await ask("design", record);
      trouble("");
      showDesign(record.turn);
    } while (waiting);
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    return;
  } finally {
    busy = false;
  }
  if (await count(study.first, record)) resting = setTimeout(() => more(record), REST);
}

// Return whether the units were counted and are still those of the design that is shown.
async function count(units, record) {
  try {
    const found = await ask("units", { ...record, units });
    if (found["called off"] || record.turn !== turn) return false;
    judged = found;
    showUnits(record.turn);
    return true;
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    return false;
  }
}

// More and more of the same units while the hand rests.
async function more(record) {
  if (!(await count(Math.min(1024, study.most), record))) return;
  const said = await refusable(ask("examined", record));
  if (said && record.turn === turn) at("cautions").replaceChildren(...said.sentences.map((text) => make("p", {}, text)));
  await picture.follow();
  await count(study.most, record);
}

function showDesign(shown) {
  const change = drawn.cost - drawn.before;
  at("cost").textContent = drawn.cost.toFixed(2);
  at("cost-change").textContent = Math.abs(change) < 5e-4 ? `${study.currency}, as drawn` : `${study.currency}, ${change > 0 ? "+" : "−"}${Math.abs(change).toFixed(2)} to the drawing's ${drawn.before.toFixed(2)}`;
  at("answer").classList.add("stale");
  zones.show(drawn);
  at("values").textContent = drawn.values.map((own) => `${own.name} ${own.value === null ? "without an answer" : `${number(own.value)} ${own.unit}`}`).join(" · ");
  unsweep();
  curves(drawn.figures);
  at("answer").dataset.drawn = shown;
}

// Curve and orders, the curves of pinned designs behind the first.
function curves(figures) {
  figures.forEach((figure, place) => {
    const ghosts = place === 0 ? designs.ghosts : [];
    draw(`curve ${place}`, at("curves"), { ...figure, height: place ? 200 : 260, series: [...ghosts, ...figure.series.map((own, k) => ({ ...own, colour: colour(k) }))] });
  });
}

function showUnits(shown) {
  at("answer").classList.remove("stale");
  const [share, low, high] = judged.yield;
  at("yield").textContent = percent(share);
  at("yield").classList.toggle("bad", high < judged.target);
  at("yield-interval").textContent = `${percent(low)} … ${percent(high)} (95 %)`;
  at("counted").textContent = `${judged.units} random units${judged.lost ? `, ${judged.lost} without an answer` : ""}`;
  at("quantiles").replaceChildren(...judged.outputs.flatMap((own) => own.quantiles.map((item) => quantile(own, item))));
  at("verdict").textContent = verdict(judged);
  at("verdict").className = high < judged.target ? "bad" : "";
  judged.outputs.forEach((own, place) => {
    const marks = [[own.upper, "limit"], [own.lower, "limit"], ...own.quantiles.map(({ share, value }) => [value, named(share)])].filter(([value]) => value !== null);
    draw(`units ${place}`, at("histograms"), {
      title: `${own.name} of ${judged.units} random units`, x_label: own.output, y_label: "share of the units [%]", height: 210,
      series: [{ label: "random units", kind: "histogram", ...own.histogram }], vertical: marks.map(([value, name]) => [value, `${name} ${number(Number(value.toPrecision(4)))} ${own.unit}`]), horizontal: [],
    });
  });
  for (const button of document.querySelectorAll("[data-unit]")) button.disabled = button.dataset.unit === "reject" && judged.outputs[0].reject === null;
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
  const own = drawn.figures[0]?.series.at(-1);
  designs.pin({ units: judged.units, design: zones.design, cost: drawn.cost, yield: judged.yield, outputs: judged.outputs, values, curve: own ?? {} });
  curves(drawn.figures);
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

async function question(kind) {
  const said = at("asked"), held = [...zones.locked];
  at("stop").hidden = false;
  at("found").replaceChildren();
  charts.delete("found");
  const names = study.sources.filter((own) => held.includes(own.group)).map((own) => own.name);
  let state = await refusable(ask("ask", { question: kind, design: zones.design, locked: names }));
  while (state && !state.answer && !state.error) {
    said.textContent = `${kind}: ${state.stage}, ${state.units} units, ${state.seconds} s`;
    await new Promise((done) => setTimeout(done, 500));
    state = await ask("state");
    if (!state.kind) state.error = "The server was started again: ask once more.";
  }
  at("stop").hidden = true;
  if (!state) return;
  if (state.error) return void (said.textContent = state.error === "stopped" ? "Stopped." : state.error);
  said.textContent = `${kind}, asked at the quick effort, took ${state.seconds} s.`;
  const told = state.answer.sentences.map((text) => make("p", {}, text)), rest = told.splice(3);
  at("found").replaceChildren(...told, ...(rest.length ? [make("details", {}, make("summary", {}, "what else it says"), ...rest)] : []),
    ...state.answer.warnings.map((text) => make("p", { class: "warning" }, text)));
  if (state.answer.figure) draw("found", at("found"), state.answer.figure);
  if (state.answer.shares) {
    zones.show(null, state.answer.shares);
    picture.shade();
  }
  if (state.answer.zones) at("found").prepend(make("button", { onclick: () => take({ zones: unlocked(state.answer.zones), settings: { ...zones.design.settings, ...state.answer.settings } }) }, "Take this drawing"));
}

async function save() {
  at("saving-error").hidden = true;
  at("saving-name").value ||= `${study.name.replace(/\W/g, "_")}_live`;
  at("saving").showModal();
}

async function saved(event) {
  event.preventDefault();
  try {
    const found = await ask("save", { design: zones.design, name: at("saving-name").value });
    at("saving").close();
    at("saved").textContent = `Saved as ${found.script} with ${found.table}. tolalloc run ${found.script} confirms it.`;
  } catch (error) {
    at("saving-error").hidden = false;
    at("saving-error").textContent = error.message;
  }
}

async function begin() {
  study = await ask("study");
  document.title = `${study.name}, live`;
  at("name").textContent = `${study.model}: ${study.name}`;
  at("conditions").textContent = [...study.conditions.map(([name, value]) => (name.endsWith("]") ? name.replace(/ ?\[(.*)\]$/, ` ${number(value)} $1`) : `${name} ${value}`)), `seed ${study.seed}`, ...study.limits].join(" · ");
  at("currency").textContent = study.currency;
  designs = new Designs(at("designs"), { currency: study.currency, take: (own) => take(own.design) });
  zones = new Zones(study, at("zones"), at("settings"), {
    changed: (design, settled) => {
      if (settled) remember(design);
      look();
    },
    effect,
    point: (names) => picture.light(names),
  });
  picture = new Picture(study, zones, () => {
    const record = { design: zones.design, unit: Number(at("unit").value) };
    return swept ? { ...record, source: swept.source, share: swept.figure.series[0].x[at("effect-share").value] } : record;
  });
  history.now = zones.design;
  at("unit").max = study.most;
  at("unit").addEventListener("change", look);
  for (const button of document.querySelectorAll("[data-unit]"))
    button.addEventListener("click", () => {
      at("unit").value = button.dataset.unit === "exact" ? 0 : judged?.outputs[0][button.dataset.unit] ?? 1;
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
  at("ask-ranking").addEventListener("click", () => question("ranking"));
  at("ask-allocation").addEventListener("click", () => question("allocation"));
  at("stop").addEventListener("click", () => ask("stop"));
  at("effect-share").addEventListener("input", follow);
  if (innerWidth <= 900) at("moving").open = false; // zones would stand far below it
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
  zones.take(history.now);
  buttons();
  await look();
  if (!drawn) take({ zones: {}, settings: {} }); // what was kept is of another drawing
  document.body.dataset.ready = "yes";
}

begin();
