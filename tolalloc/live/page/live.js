// The live page: what a hand does becomes a design, a design becomes answers, a newer design calls off older ones.

import { Chart, number } from "./chart.js";
import { Designs } from "./designs.js";
import { Mechanism } from "./mechanism.js";
import { Zones, make } from "./zones.js";

const token = new URLSearchParams(location.search).get("token");
const tab = crypto.randomUUID();
const at = (id) => document.getElementById(id);
const REST = 350; // ms after which a hand rests and more units are asked for

let mechanism = null, pictured = "";
let turn = 0, study, zones, designs, drawn = null, judged = null, busy = false, waiting = false, resting = null;
const history = { past: [], future: [], now: null };
const charts = new Map();

class Refusal extends Error {}

async function ask(name, record = {}) {
  let answer;
  try {
    answer = await fetch(`/api/${name}`, { method: "POST", headers: { "Content-Type": "application/json", "X-Token": token }, body: JSON.stringify({ tab, ...record }) });
  } catch {
    trouble("The server does not answer. Start tolalloc open again in the same folder: the page then goes on.");
    await new Promise((done) => setTimeout(done, 1500));
    return ask(name, record);
  }
  const found = await answer.json();
  if (answer.ok) {
    trouble("");
    return found;
  }
  trouble(found.error);
  throw new Refusal(found.error);
}

function trouble(sentence) {
  at("trouble").hidden = !sentence;
  at("trouble").textContent = sentence;
}

function draw(key, element, figure) {
  if (!charts.has(key)) {
    const place = make("div");
    element.append(make("figure", {}, make("figcaption", {}), place));
    charts.set(key, new Chart(place, figure));
  } else charts.get(key).update(figure);
  const caption = charts.get(key).element.parentElement.querySelector("figcaption");
  caption.textContent = `${figure.title}.`;
}

// Price and curve at once; while one request is under way the newest design waits.
async function look() {
  if (busy) return void (waiting = true);
  busy = true;
  try {
    do {
      waiting = false;
      const record = { design: zones.design, unit: Number(at("unit").value), turn: ++turn };
      drawn = await ask("design", record);
      showDesign();
      await count(study.chunk, record);
    } while (waiting);
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
  } finally {
    busy = false;
  }
  clearTimeout(resting);
  resting = setTimeout(more, REST);
}

async function count(units, record) {
  const found = await ask("units", { ...record, units });
  if (found["called off"]) return false;
  judged = found;
  showUnits();
  return true;
}

// More and more of the same units while the hand rests.
async function more() {
  const mine = turn, record = { design: zones.design, turn };
  await picture();
  for (const units of [1024, study.most]) {
    if (turn !== mine || busy) return;
    try {
      if (!(await count(units, record))) return;
    } catch (error) {
      if (error instanceof Refusal) return;
      throw error;
    }
  }
}

// The moving picture follows once the hand rests: it needs every angle in both directions.
async function picture() {
  const record = { design: zones.design, unit: Number(at("unit").value) }, key = JSON.stringify(record);
  if (key === pictured || !at("moving").open || at("moving").dataset.none) return;
  try {
    const { scene } = await ask("scene", record);
    pictured = key;
    at("moving").hidden = !scene;
    if (!scene) return void (at("moving").dataset.none = "yes");
    if (mechanism) mechanism.update(scene);
    else mechanism = new Mechanism(at("mechanism"), scene, { onPoint: (id) => zones.light(sourcesAt(id)), onChoose: (id) => goTo(sourcesAt(id)) });
    shade();
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
  }
}

const sourcesAt = (id) => mechanism?.scene.places.find((place) => place.id === id)?.sources ?? [];

function goTo([source]) {
  const own = study.sources.find((item) => item.name === source);
  if (own) zones.rows.get(own.group)?.scrollIntoView({ block: "center" });
}

// Places take the colour of what their sources contribute, as far as a ranking has said it.
function shade() {
  if (!mechanism || !zones.shares) return;
  const most = Math.max(...Object.values(zones.shares), 1e-9);
  mechanism.shade(Object.fromEntries(mechanism.scene.places.map((place) => [place.id, place.sources.reduce((sum, own) => sum + (zones.shares[own] ?? 0), 0) / most])));
}

function showDesign() {
  const change = drawn.cost - drawn.before;
  at("cost").textContent = drawn.cost.toFixed(2);
  at("cost-change").textContent = Math.abs(change) < 5e-4 ? "as drawn" : `${change > 0 ? "+" : "−"}${Math.abs(change).toFixed(2)} to the drawing's ${drawn.before.toFixed(2)}`;
  at("answer").classList.add("stale");
  zones.show(drawn.costs);
  at("values").textContent = drawn.values.map((own) => `${own.name} ${own.value === null ? "without an answer" : `${number(own.value)} ${own.unit}`}`).join(" · ");
  drawn.figures.forEach((figure, place) => {
    const ghosts = place === 0 ? designs.ghosts : [];
    draw(`curve ${place}`, at("curves"), { ...figure, height: place ? 200 : 260, series: [...figure.series, ...ghosts] });
  });
}

const percent = (share) => `${(100 * share).toFixed(2)} %`;

function showUnits() {
  at("answer").classList.remove("stale");
  const [share, low, high] = judged.yield;
  at("yield").textContent = percent(share);
  at("yield").classList.toggle("bad", high < judged.target);
  at("yield-interval").textContent = `${percent(low)} … ${percent(high)}`;
  at("counted").textContent = `${judged.units} random units${judged.lost ? `, ${judged.lost} without an answer` : ""}`;
  at("quantiles").replaceChildren(...judged.outputs.map((own) => {
    const beyond = (own.upper !== null && own.quantile > own.upper) || (own.lower !== null && own.quantile < own.lower);
    const end = (value, none) => (value === null ? none : number(value));
    return make("div", {}, make("dt", {}, `${own.name} kept by ${percent(own.share)}`), make("dd", { class: beyond ? "bad" : "" }, `${own.quantile === null ? "–" : number(Number(own.quantile.toPrecision(4)))} ${own.unit}`),
      make("dd", { class: "small" }, `${end(own.interval[0], "?")} … ${end(own.interval[1], "more units needed")}`));
  }));
  at("verdict").textContent = verdict(low, high);
  at("verdict").className = high < judged.target ? "bad" : "";
  judged.outputs.forEach((own, place) => {
    const marks = [[own.upper, "limit"], [own.lower, "limit"]].filter(([value]) => value !== null);
    draw(`units ${place}`, at("histograms"), {
      title: `${own.name} of ${judged.units} random units`, x_label: own.output, y_label: "share of the units [%]", height: 210,
      series: [{ label: "random units", kind: "histogram", ...own.histogram }], vertical: marks.map(([value, name]) => [value, `${name} ${number(value)} ${own.unit}`]), horizontal: [],
    });
  });
  for (const button of document.querySelectorAll("[data-unit]")) button.disabled = button.dataset.unit === "reject" && judged.outputs[0].reject === null;
}

function verdict(low, high) {
  const jammed = judged.outputs.find((own) => own.output.startsWith("largest pin force without torque"));
  const free = jammed ? ` ${percent(1 - jammed.inside[0])} of the units are jammed: their pins press without torque.` : "";
  if (low >= judged.target) return `The limits are kept: the yield is at least the ${percent(judged.target)} asked for.${free}`;
  if (high < judged.target) return `The limits are not kept: the yield is below the ${percent(judged.target)} asked for.${free}`;
  return `These units leave it open whether the yield is the ${percent(judged.target)} asked for; a run confirms it.${free}`;
}

function remember(design) {
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

function pin() {
  if (!drawn || !judged) return;
  const values = Object.fromEntries([...zones.groups].map(([group, members]) => [`${group} [µm]`, zones.zone(members[0].name)]));
  for (const own of study.settings) values[own.name] = zones.setting(own.name);
  const [first] = drawn.figures[0]?.series ?? [];
  designs.pin({ name: `design ${designs.pinned.length + 1}`, design: zones.design, cost: drawn.cost, yield: judged.yield, outputs: judged.outputs, values, curve: first ?? {} });
  showDesign();
  at("answer").classList.remove("stale");
}

async function effect(source) {
  const found = await ask("sweep", { design: zones.design, unit: Number(at("unit").value), source });
  at("effect").hidden = false;
  draw("effect", at("effect").querySelector("div"), { ...found.figure, height: 220 });
  at("effect").scrollIntoView({ block: "nearest" });
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
  let state = await ask("ask", { question: kind, design: zones.design, locked: held });
  while (!state.answer && !state.error) {
    said.textContent = `${kind}: ${state.stage}, ${state.units} units, ${state.seconds} s`;
    await new Promise((done) => setTimeout(done, 500));
    state = await ask("state");
  }
  at("stop").hidden = true;
  if (state.error) return void (said.textContent = state.error === "stopped" ? "Stopped." : state.error);
  said.textContent = `${kind}, asked at the quick effort, took ${state.seconds} s.`;
  at("found").replaceChildren(...state.answer.sentences.map((text) => make("p", {}, text)), ...state.answer.warnings.map((text) => make("p", { class: "warning" }, text)));
  if (state.answer.figure) draw("found", at("found"), state.answer.figure);
  if (state.answer.shares) {
    zones.show(undefined, state.answer.shares);
    shade();
  }
  if (state.answer.zones) at("found").prepend(make("button", { onclick: () => take({ zones: unlocked(state.answer.zones), settings: { ...zones.design.settings, ...state.answer.settings } }) }, "Take this drawing"));
}

async function save() {
  at("saving-error").hidden = true;
  at("saving-name").value ||= `${study.name.replace(/\W/g, "_")}_live`;
  at("saving").showModal();
}

async function saved(event) {
  if (event.submitter?.value !== "save") return;
  event.preventDefault();
  try {
    const found = await ask("save", { design: zones.design, name: at("saving-name").value });
    at("saving").close();
    at("asked").textContent = `Saved as ${found.script} with ${found.table}. tolalloc run ${found.script} confirms it.`;
  } catch (error) {
    at("saving-error").hidden = false;
    at("saving-error").textContent = error.message;
  }
}

async function begin() {
  study = await ask("study");
  document.title = `${study.name}, live`;
  at("name").textContent = `${study.model}: ${study.name}`;
  at("conditions").textContent = [...study.conditions, `seed ${study.seed}`, ...study.limits].join(" · ");
  designs = new Designs(at("designs"), { take: (own) => take(own.design) });
  zones = new Zones(study, at("zones"), at("settings"), {
    changed: (design, settled) => {
      if (settled) remember(design);
      look();
    },
    effect,
    point: (names) => mechanism?.light(mechanism.scene.places.filter((place) => place.sources.some((own) => names.includes(own))).map((place) => place.id)),
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
  at("ask-ranking").addEventListener("click", () => question("ranking"));
  at("ask-allocation").addEventListener("click", () => question("allocation"));
  at("stop").addEventListener("click", () => ask("stop"));
  zones.show();
  await look();
  document.body.dataset.ready = "yes";
}

begin();
