// The reducer, drawn and moving: one scene of `tolalloc.reducers.scene` as SVG, without any library.
// Kinematics, forces, gaps and displacements are the scene's; here they are only looked up, magnified and drawn.

const SVG = "http://www.w3.org/2000/svg";
const TURN = 2 * Math.PI;
const SECONDS_PER_CRANK_TURN = 8;
const STEPS_PER_CRANK_TURN = 24;
const MAGNIFICATIONS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const VERSION = 1;

/** Numbers of an entry that `tolalloc.reports.picture.blocks` wrote. */
export function numbers(entry) {
  const text = atob(entry.data), bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
  if (entry.type === "u1") return Float64Array.from(bytes, (step) => entry.low + entry.step * step);
  return new Float64Array(bytes.buffer);
}

/** Where every axis stands at a carrier angle, nominal: positions in mm, angles in rad. */
export function positions(scene, carrierAngle) {
  const { outline, start, turns } = scene;
  const all = (part) => start[part].map((first) => first + turns[part] * carrierAngle);
  const around = (radius) => (direction) => [radius * Math.cos(direction), radius * Math.sin(direction)];
  const crankDirection = all("crank");
  const cranks = all("carrier").map(around(outline.crank_circle_radius));
  const discs = crankDirection.map(around(outline.eccentricity));
  return {
    carrier: all("carrier"), crank: crankDirection, disc: all("disc"), planet: all("planet"), sun: all("sun"),
    cranks, discs, pins: start.pin.map(around(outline.pin_circle_radius)),
    ...(start.pinion ? { centre: all("centre"), pinion: all("pinion") } : {}),
    journals: cranks.map(([x, y]) => discs.map(([dx, dy]) => [x + dx, y + dy])),
  };
}

function made(name, attributes = {}, parent = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (parent) parent.append(element);
  return element;
}

function html(name, className, text, parent) {
  const element = document.createElement(name);
  if (className) element.className = className;
  if (text) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

const degrees = (angle) => (angle * 360) / TURN;
const moved = ([x, y], angle = 0) => `translate(${x.toFixed(4)} ${y.toFixed(4)}) rotate(${degrees(angle).toFixed(4)})`;
const ring = ([x, y], radius) =>
  `M${(x + radius).toFixed(3)} ${y.toFixed(3)}a${radius} ${radius} 0 1 0 ${-2 * radius} 0a${radius} ${radius} 0 1 0 ${2 * radius} 0Z`;

/** The outer half of a circle about a place: a groove in the ring that the place lies on. */
const half = ([x, y], radius) => {
  const away = radius / Math.hypot(x, y), [sx, sy] = [-y * away, x * away];
  const write = (side) => `${(x + side * sx).toFixed(3)} ${(y + side * sy).toFixed(3)}`;
  return `M${write(-1)}A${radius} ${radius} 0 0 1 ${write(1)}Z`;
};

/** A number with three digits that count, as a reader writes it. */
const short = (value) => {
  const size = Math.abs(value), text = String(size >= 1000 ? Math.round(size) : Number(size.toPrecision(3)));
  return (value < 0 ? "−" : "") + text.replace(/\B(?=(\d{3})+(?!\d)(?<!\.\d*))/g, ",");
};

/** An involute spur gear about the origin, its first tooth on the x axis. */
function gear(teeth, module, pressureAngle) {
  const pitch = (module * teeth) / 2, base = pitch * Math.cos(pressureAngle);
  const tip = pitch + module, root = pitch - 1.25 * module;
  const involute = (angle) => Math.tan(angle) - angle;
  const half = (radius) =>
    0.98 * (TURN / 4 / teeth) + involute(pressureAngle) - involute(Math.acos(Math.min(base / Math.max(radius, base), 1)));
  const flank = [root, ...Array.from({ length: 6 }, (_, at) => Math.max(base, root) + ((tip - Math.max(base, root)) * at) / 5)];
  const points = [];
  for (let tooth = 0; tooth < teeth; tooth += 1) {
    const middle = (TURN * tooth) / teeth;
    for (const side of [-1, 1]) {
      for (const radius of side < 0 ? flank : [...flank].reverse()) {
        const angle = middle + side * Math.max(half(radius), 0);
        points.push(`${(radius * Math.cos(angle)).toFixed(3)} ${(radius * Math.sin(angle)).toFixed(3)}`);
      }
    }
  }
  return `M${points.join("L")}Z`;
}

/** The teeth of a disc in its own frame, as points that a frame moves along their normals. */
class Teeth {
  constructor(scene) {
    const { tooth, outline } = scene, count = tooth.exact.length * outline.disc_teeth;
    this.count = count;
    for (const field of ["x", "y", "modifiedX", "modifiedY", "normalX", "normalY", "polar"]) this[field] = new Float64Array(count);
    let at = 0;
    for (let number = 0; number < outline.disc_teeth; number += 1) {
      const turn = (TURN * number) / outline.disc_teeth, cosine = Math.cos(turn), sine = Math.sin(turn);
      const turned = ([x, y]) => [cosine * x - sine * y, sine * x + cosine * y];
      for (let point = 0; point < tooth.exact.length; point += 1, at += 1) {
        [this.x[at], this.y[at]] = turned(tooth.exact[point]);
        [this.modifiedX[at], this.modifiedY[at]] = turned(tooth.modified[point]);
        [this.normalX[at], this.normalY[at]] = turned(tooth.normal[point]);
        this.polar[at] = Math.atan2(tooth.exact[point][1], tooth.exact[point][0]) + turn;
      }
    }
  }

  /**
   * The outline whose distance from every pin is the gap, magnified: contacts in the disc's frame, gaps in mm.
   * Without modification and errors every tooth touches its pin; from there it is moved along its normal.
   */
  outline(contacts, magnification) {
    const pins = contacts.length, parts = new Array(this.count);
    const from = (polar) => ((polar - contacts[0].polar) % TURN + TURN) % TURN;
    const reach = contacts.map((contact) => from(contact.polar));
    let first = 0, least = Infinity;
    for (let at = 0; at < this.count; at += 1) {
      const own = from(this.polar[at]);
      if (own < least) [first, least] = [at, own];
    }
    for (let step = 0, pin = 0; step < this.count; step += 1) {
      const at = (first + step) % this.count, own = from(this.polar[at]);
      while (pin < pins - 1 && reach[pin + 1] <= own) pin += 1;
      const end = pin + 1 < pins ? reach[pin + 1] : TURN, next = (pin + 1) % pins;
      const share = (own - reach[pin]) / (end - reach[pin] || 1);
      const away = magnification * (contacts[pin].gap * (1 - share) + contacts[next].gap * share);
      const x = this.x[at] + away * this.normalX[at], y = this.y[at] + away * this.normalY[at];
      parts[at] = `${x.toFixed(3)} ${y.toFixed(3)}`;
    }
    return `M${parts.join("L")}Z`;
  }

  get modified() {
    return `M${Array.from(this.modifiedX, (x, at) => `${x.toFixed(3)} ${this.modifiedY[at].toFixed(3)}`).join("L")}Z`;
  }
}

/** Light a place for the rows of tables that name one of its sources, and those rows for the place. */
export function follow(mechanism, root = document) {
  const placeOf = new Map(mechanism.scene.places.flatMap(({ id, sources }) => sources.map((source) => [source, id])));
  const rows = new Map(mechanism.scene.places.map(({ id }) => [id, []]));
  for (const cell of root.querySelectorAll("table td, table th")) {
    const id = placeOf.get(cell.textContent.trim());
    if (!id) continue;
    const row = cell.parentElement;
    rows.get(id).push(row);
    row.addEventListener("pointerenter", () => mechanism.light([id]));
    row.addEventListener("pointerleave", () => mechanism.light([]));
  }
  mechanism.handlers.onPoint = (pointed) => {
    for (const [id, own] of rows) for (const row of own) row.classList.toggle("mechanism-row", id === pointed);
  };
}

export class Mechanism {
  constructor(element, scene, { onPoint = () => {}, onChoose = () => {}, onTurn = () => {}, errorAt = null, controls = true } = {}) {
    this.element = element;
    this.handlers = { onPoint, onChoose, onTurn };
    this.errorAt = errorAt; // a finer curve of the forward turn: its error [arcsec] at an angle of the carrier [°]
    this.withControls = controls;
    this.phase = 0;
    this.sense = 1;
    this.factor = null;
    this.lit = new Set();
    this.shares = {};
    this.running = null;
    this.update(scene);
  }

  /** Show another unit or other settings of the same reducer; another structure is drawn anew. */
  update(scene) {
    if (scene.version !== VERSION) throw new Error(`The picture knows version ${VERSION} of a scene, not ${scene.version}.`);
    const structure = JSON.stringify([scene.outline, scene.places.map((place) => place.id)]);
    this.scene = scene;
    const shape = JSON.stringify(scene.tooth);
    if (shape !== this.shape) {
      [this.shape, this.teeth] = [shape, new Teeth(scene)];
      for (const path of this.element.querySelectorAll(".other-disc")) path.setAttribute("d", this.teeth.modified);
    }
    this.states = Object.fromEntries(["forward", "backward"].map((name) => {
      const states = scene[name];
      return [name, {
        torque: states.torque, force: numbers(states.force), gap: numbers(states.gap),
        displacement: numbers(states.displacement), error: numbers(states.transmission_error),
        size: states.displacement.shape[1],
      }];
    }));
    this.frames = scene.carrier_angle.shape[0];
    this.largest = Math.max(1e-12, ...["forward", "backward"].map((name) => this.states[name].force.reduce((most, own) => Math.max(most, own), 0)));
    if (structure !== this.structure) {
      this.structure = structure;
      this.build();
    }
    this.draw();
  }

  turn(phase) {
    this.phase = ((phase % 1) + 1) % 1;
    this.draw();
  }

  /** Turn to an angle of the carrier [°], in the turn that is shown. */
  turnTo(angle) {
    const turns = this.scene.output_turns, whole = Math.floor(this.phase * turns + 1e-9);
    this.turn((whole + Math.min(Math.max(angle / 360, 0), 1 - 1e-9)) / turns);
  }

  /** Run; for readers who asked for less motion one step of a crank's turn instead. */
  play() {
    if (this.running !== null) return;
    const crankTurns = Math.abs(this.scene.turns.crank) * this.scene.output_turns;
    if (this.stepwise) {
      this.turn(this.phase + this.sense / STEPS_PER_CRANK_TURN / crankTurns);
      return;
    }
    let before = null;
    const step = (now) => {
      const passed = before === null ? 0 : Math.min((now - before) / 1000, 0.1);
      before = now;
      this.turn(this.phase + (this.sense * passed) / SECONDS_PER_CRANK_TURN / crankTurns);
      this.running = requestAnimationFrame(step);
    };
    this.running = requestAnimationFrame(step);
    this.showState();
  }

  pause() {
    if (this.running !== null) cancelAnimationFrame(this.running);
    this.running = null;
    this.showState();
  }

  direction(sense) {
    this.sense = sense < 0 ? -1 : 1;
    this.showState();
    this.draw();
  }

  magnify(factor) {
    this.factor = Math.max(1, Number(factor) || 1);
    this.draw();
  }

  light(ids) {
    this.lit = new Set(ids);
    for (const [id, elements] of this.drawn) for (const element of elements) element.classList.toggle("lit", this.lit.has(id));
    this.say(ids.length ? ids[0] : null);
  }

  shade(shares) {
    this.shares = shares;
    for (const [id, elements] of this.drawn) {
      for (const element of elements) {
        const share = Math.min(Math.max(shares[id] ?? 0, 0), 1);
        element.style.setProperty("--share", `${(100 * share).toFixed(1)}%`);
        element.style.setProperty("--weight", share.toFixed(3));
        element.classList.toggle("shaded", share > 0);
      }
    }
    this.element.classList.toggle("has-shades", Object.values(shares).some((share) => share > 0));
  }

  get stepwise() {
    return matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  get carrierAngle() {
    return TURN * this.scene.output_turns * this.phase;
  }

  get magnification() {
    return this.factor ?? this.scene.magnification;
  }

  /** Forces, gaps and displacements at the present phase, straight between the scene's angles. */
  get state() {
    const own = this.states[this.sense > 0 ? "forward" : "backward"];
    const { pin_count: pins, disc_count: discs } = this.scene.outline;
    const place = (((this.carrierAngle / TURN) % 1) + 1) % 1 * this.frames;
    const low = Math.floor(place) % this.frames, high = (low + 1) % this.frames, share = place - Math.floor(place);
    const between = (values, size) =>
      Float64Array.from({ length: size }, (_, at) => values[low * size + at] * (1 - share) + values[high * size + at] * share);
    return {
      torque: own.torque, pins,
      force: between(own.force, pins * discs), gap: between(own.gap, pins * discs),
      displacement: between(own.displacement, own.size), error: between(own.error, 1)[0],
    };
  }

  // Building -----------------------------------------------------------------------------------------------------

  build() {
    const { scene, element } = this;
    this.drawn = new Map(scene.places.map((place) => [place.id, []]));
    this.labels = new Map(scene.places.map((place) => [place.id, place]));
    this.painters = [];
    element.classList.add("mechanism");
    element.replaceChildren();
    if (this.withControls) this.buildControls();
    this.said = html("p", "mechanism-said", "", element);
    this.said.setAttribute("aria-live", "polite");
    const views = html("div", "mechanism-views", "", element);
    for (let disc = 0; disc < scene.outline.disc_count; disc += 1) {
      this.buildView(views, `Disc ${disc + 1} on the pins`, (view) => this.buildDisc(view, disc));
    }
    if (scene.outline.output_pin_count) this.buildView(views, "Output and input shaft", (view) => this.buildOutput(view));
    else this.buildView(views, "Carrier, planets and sun", (view) => this.buildFirstStage(view));
    if (scene.outline.centre_teeth) this.buildView(views, "Centre gear and input pinion", (view) => this.buildCentreGear(view));
    this.buildLegend();
    this.shade(this.shares);
    this.light([...this.lit]);
    this.say(null);
    this.showState();
  }

  buildControls() {
    const bar = html("div", "mechanism-controls", "", this.element);
    this.playButton = html("button", "", "", bar);
    this.playButton.type = "button";
    this.playButton.addEventListener("click", () => (this.running === null ? this.play() : this.pause()));
    this.senseButton = html("button", "", "", bar);
    this.senseButton.type = "button";
    this.senseButton.addEventListener("click", () => this.direction(-this.sense));
    const angle = html("label", "mechanism-angle", "carrier angle ", bar);
    this.angleInput = html("input", "", "", angle);
    Object.assign(this.angleInput, { type: "range", min: 0, max: 1, step: "any", value: 0 });
    this.angleInput.addEventListener("input", () => this.turn(Math.min(Number(this.angleInput.value), 1 - 1e-12)));
    const larger = html("label", "", "errors and gaps × ", bar);
    this.factorInput = html("select", "", "", larger);
    for (const factor of MAGNIFICATIONS) html("option", "", String(factor), this.factorInput);
    this.factorInput.addEventListener("change", () => this.magnify(this.factorInput.value));
  }

  buildView(views, name, fill) {
    const { housing_radius: radius } = this.scene.outline, figure = html("figure", "", "", views), reach = 1.02 * radius;
    const svg = made("svg", { viewBox: `${-reach} ${-reach} ${2 * reach} ${2 * reach}`, role: "group", "aria-label": name }, figure);
    const view = made("g", { transform: "scale(1 -1)" }, svg);
    html("figcaption", "", name, figure);
    fill(view);
    const own = [...view.querySelectorAll("[data-place]")];
    own.forEach((element, at) => {
      element.setAttribute("tabindex", at === 0 ? "0" : "-1");
      element.addEventListener("keydown", (event) => this.onKey(event, own, at));
      // One stop for the tabulator in every view, the place that was focused last; arrows go on from there.
      element.addEventListener("focus", () => own.forEach((other) => other.setAttribute("tabindex", other === element ? "0" : "-1")));
    });
  }

  onKey(event, own, at) {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (step) {
      own[(at + step + own.length) % own.length].focus();
      event.preventDefault();
    } else if (event.key === "Enter" || event.key === " ") {
      this.handlers.onChoose(own[at].dataset.place);
      event.preventDefault();
    }
  }

  /** An element that stands for a place: it can be pointed at, focused and chosen. */
  place(id, name, attributes, parent) {
    const element = made(name, { ...attributes, class: `place ${attributes.class ?? ""}`, "data-place": id, role: "button" }, parent);
    const { label, sources } = this.labels.get(id);
    element.setAttribute("aria-label", sources.length ? `${label}: ${sources.join(", ")}` : label);
    element.setAttribute("focusable", "true");
    for (const [event, value] of [["pointerenter", id], ["pointerleave", null], ["focus", id], ["blur", null]]) {
      element.addEventListener(event, () => {
        this.say(value);
        this.handlers.onPoint(value);
      });
    }
    element.addEventListener("click", () => this.handlers.onChoose(id));
    this.drawn.get(id).push(element);
    return element;
  }

  buildDisc(view, disc) {
    const { scene } = this, { outline } = scene, { pin_radius: pin, pin_circle_radius: circle } = outline;
    const number = disc + 1, origin = [0, 0];
    const onRing = [this.place("housing.pins", "path", {
      class: "housing", "fill-rule": "evenodd", d: ring(origin, outline.housing_radius) + ring(origin, circle),
    }, view)];
    const at = positions(scene, 0).pins;
    const grooves = at.map((place) => half(place, 1.45 * pin)).join("");
    onRing.push(this.place("housing.grooves", "path", { class: "groove", d: grooves }, view));
    const others = [];
    for (let other = outline.disc_count - 1; other >= 0; other -= 1) {
      if (other !== disc) others.push([other, made("path", { class: "other-disc", d: this.teeth.modified }, view)]);
    }
    const body = this.place(`disc${number}`, "path", { class: "disc", "fill-rule": "evenodd" }, view);
    onRing.push(this.place("pins", "path", { class: "pin", d: at.map((place) => ring(place, pin)).join("") }, view));
    const teeth = this.place(`disc${number}.teeth`, "path", { class: "edge" }, view);
    if (outline.output_pin_count) this.buildHoles(view, disc);
    const pattern = outline.crank_count
      ? this.place(`disc${number}.bores`, "circle", { class: "pattern", r: outline.crank_circle_radius }, view) : null;
    const bores = [], cranks = [];
    for (let crank = 0; crank < outline.crank_count; crank += 1) {
      bores.push(this.place(`disc${number}.bore${crank + 1}`, "circle", { class: "bore", r: outline.bore_radius }, view));
      const other = [...Array(outline.disc_count).keys()].filter((own) => own !== disc)
        .map((own) => [own, made("circle", { class: "other-journal", r: outline.journal_radius }, view)]);
      const journal = this.place(`crank${crank + 1}.journal${number}`, "circle", { class: "journal", r: outline.journal_radius }, view);
      const shaft = this.place(`crank${crank + 1}`, "circle", { class: "crank", r: 0.45 * outline.journal_radius }, view);
      const lever = made("path", { class: "lever" }, view);
      cranks.push({ other, journal, shaft, lever });
    }
    const arrows = made("path", { class: "force" }, view);
    onRing.push(arrows);
    const end = outline.housing_radius, inner = circle + 1.6 * pin;
    const output = made("path", { class: "output", d: `M${0.995 * end} 0L${inner} ${0.035 * end}L${inner} ${-0.035 * end}Z` }, view);
    this.painters.push((pose) => {
      const angle = pose.at.disc[disc], away = pose.ring[disc], [x, y] = pose.at.discs[disc];
      const centre = [x + away[0], y + away[1]]; // the outline has its gaps from the pins, which go with the ring
      for (const own of onRing) own.setAttribute("transform", moved(away));
      for (const [other, path] of others) path.setAttribute("transform", moved(pose.at.discs[other], pose.at.disc[other]));
      const shape = this.teeth.outline(pose.contacts[disc], pose.magnification);
      const holes = pose.bores[disc].map((own) => ring(own, outline.bore_radius)).join("");
      teeth.setAttribute("d", shape);
      teeth.setAttribute("transform", moved(centre, angle));
      // Holes stand in the housing's frame: turned back into the disc's own.
      body.setAttribute("d", shape + this.holes(holes ? pose.bores[disc] : [], centre, angle));
      body.setAttribute("transform", moved(centre, angle));
      pattern?.setAttribute("transform", moved(pose.discCentres[disc]));
      bores.forEach((bore, crank) => bore.setAttribute("transform", moved(pose.bores[disc][crank])));
      cranks.forEach(({ other, journal, shaft, lever }, crank) => {
        for (const [own, circleOf] of other) circleOf.setAttribute("transform", moved(pose.journals[crank][own]));
        const [axis, eccentric] = [pose.cranks[crank], pose.journals[crank][disc]];
        journal.setAttribute("transform", moved(eccentric));
        shaft.setAttribute("transform", moved(axis));
        lever.setAttribute("d", `M${axis[0]} ${axis[1]}L${eccentric[0]} ${eccentric[1]}`);
      });
      arrows.setAttribute("d", this.arrows(pose.contacts[disc]));
      output.setAttribute("transform", moved([0, 0], pose.output));
    });
  }

  /** Holes of a disc with the output pins in them, and the eccentric shaft in its bore. */
  buildHoles(view, disc) {
    const { outline } = this.scene, number = disc + 1;
    const holes = this.place(`disc${number}.holes`, "path", { class: "bore" }, view);
    const pins = this.place("output.pins", "path", { class: "crank" }, view);
    const bore = this.place(`disc${number}.bore`, "circle", { class: "bore", r: outline.disc_hole_radius }, view);
    const journal = this.place(`shaft.journal${number}`, "circle", { class: "journal", r: outline.journal_radius }, view);
    const shaft = this.place("shaft", "circle", { class: "crank", r: outline.shaft_radius }, view);
    const lever = made("path", { class: "lever" }, view);
    this.painters.push((pose) => {
      const [axis, eccentric] = [pose.sun, pose.eccentrics[disc]];
      holes.setAttribute("d", pose.bores[disc].map((own) => ring(own, outline.bore_radius)).join(""));
      pins.setAttribute("d", pose.carrierBores.map((own) => ring(own, outline.carrier_bore_radius)).join(""));
      bore.setAttribute("transform", moved(pose.discCentres[disc]));
      journal.setAttribute("transform", moved(eccentric));
      shaft.setAttribute("transform", moved(axis));
      lever.setAttribute("d", `M${axis[0]} ${axis[1]}L${eccentric[0]} ${eccentric[1]}`);
    });
  }

  holes(bores, [x, y], angle) {
    const { outline } = this.scene, cosine = Math.cos(angle), sine = Math.sin(angle);
    const back = ([px, py]) => [cosine * (px - x) + sine * (py - y), cosine * (py - y) - sine * (px - x)];
    return bores.map((own) => ring(back(own), outline.bore_radius)).join("") + ring([0, 0], outline.disc_hole_radius);
  }

  arrows(contacts) {
    const { outline } = this.scene, longest = 0.3 * outline.pin_circle_radius, parts = [];
    for (const { force, point, normal } of contacts) {
      const length = (longest * force) / this.largest;
      if (length < 0.004 * outline.pin_circle_radius) continue;
      const [x, y] = point, [nx, ny] = normal, head = Math.min(0.35 * length, 0.028 * outline.pin_circle_radius);
      const tip = [x + length * nx, y + length * ny], neck = [tip[0] - head * nx, tip[1] - head * ny];
      const write = (px, py) => `${px.toFixed(2)} ${py.toFixed(2)}`;
      parts.push(`M${write(x, y)}L${write(...tip)}M${write(neck[0] - 0.5 * head * ny, neck[1] + 0.5 * head * nx)}` +
        `L${write(...tip)}L${write(neck[0] + 0.5 * head * ny, neck[1] - 0.5 * head * nx)}`);
    }
    return parts.join("");
  }

  buildOutput(view) {
    const { outline } = this.scene, { pin_circle_radius: circle, pin_radius: pin, housing_radius: end } = outline;
    const inner = circle + 1.6 * pin;
    made("circle", { class: "outline", r: outline.housing_radius }, view);
    const carrier = this.place("carrier", "path", { class: "carrier" }, view);
    carrier.setAttribute("d", ring([0, 0], outline.carrier_radius));
    const pins = this.place("output.pins", "path", { class: "crank" }, view), turning = made("g", {}, view);
    this.place("shaft", "circle", { class: "crank", r: outline.shaft_radius }, turning);
    made("path", { class: "mark", d: `M${0.3 * outline.shaft_radius} 0L${0.9 * outline.shaft_radius} 0` }, turning);
    const output = made("path", { class: "output", d: `M${0.995 * end} 0L${inner} ${0.035 * end}L${inner} ${-0.035 * end}Z` }, view);
    this.painters.push((pose) => {
      carrier.setAttribute("transform", moved(pose.carrierCentre));
      pins.setAttribute("d", pose.carrierBores.map((own) => ring(own, outline.carrier_bore_radius)).join(""));
      turning.setAttribute("transform", moved(pose.sun, pose.at.sun[0]));
      output.setAttribute("transform", moved([0, 0], pose.output));
    });
  }

  buildFirstStage(view) {
    const { scene } = this, { outline } = scene;
    made("circle", { class: "outline", r: outline.housing_radius }, view);
    const carrier = this.place("carrier", "path", { class: "carrier" }, view);
    carrier.setAttribute("d", ring([0, 0], outline.carrier_radius));
    const { pin_circle_radius: circle, pin_radius: pin, housing_radius: end } = outline, inner = circle + 1.6 * pin;
    const planetShape = gear(outline.planet_teeth, outline.module, outline.pressure_angle);
    const sunShape = gear(outline.sun_teeth, outline.module, outline.pressure_angle);
    const web = (teeth) => Math.max((outline.module * teeth) / 2 - 2 * outline.module, 0.35 * outline.module * teeth);
    const planets = outline.crank_count ? [...Array(outline.crank_count).keys()].map((crank) => {
      const turning = made("g", {}, view);
      this.place(`planet${crank + 1}.teeth`, "path", { class: "gear-teeth", d: planetShape }, turning);
      this.place(`planet${crank + 1}`, "circle", { class: "gear", r: web(outline.planet_teeth) }, turning);
      made("path", { class: "mark", d: `M${0.62 * web(outline.planet_teeth)} 0L${0.95 * web(outline.planet_teeth)} 0` }, turning);
      const bore = this.place(`carrier.bore${crank + 1}`, "circle", { class: "bore", r: outline.carrier_bore_radius }, view);
      const shaft = this.place(`crank${crank + 1}`, "circle", { class: "crank", r: outline.shaft_radius }, view);
      return { turning, bore, shaft };
    }) : [];
    const sun = made("g", {}, view);
    this.place("sun.teeth", "path", { class: "gear-teeth sun", d: sunShape }, sun);
    this.place("sun", "circle", { class: "gear sun", r: web(outline.sun_teeth) }, sun);
    made("path", { class: "mark", d: `M${0.3 * web(outline.sun_teeth)} 0L${0.9 * web(outline.sun_teeth)} 0` }, sun);
    const meshes = planets.map((_, crank) => this.place(`mesh${crank + 1}`, "circle", { class: "mesh", r: 1.1 * outline.module }, view));
    const output = made("path", { class: "output", d: `M${0.995 * end} 0L${inner} ${0.035 * end}L${inner} ${-0.035 * end}Z` }, view);
    this.painters.push((pose) => {
      carrier.setAttribute("transform", moved(pose.carrierCentre));
      output.setAttribute("transform", moved([0, 0], pose.output));
      planets.forEach(({ turning, bore, shaft }, crank) => {
        turning.setAttribute("transform", moved(pose.planets[crank], pose.at.planet[crank]));
        bore.setAttribute("transform", moved(pose.carrierBores[crank]));
        shaft.setAttribute("transform", moved(pose.cranks[crank]));
      });
      sun.setAttribute("transform", moved(pose.sun, pose.at.sun[0]));
      const radius = (outline.module * outline.sun_teeth) / 2;
      meshes.forEach((mesh, crank) => {
        const direction = pose.at.carrier[crank];
        mesh.setAttribute("transform", moved([radius * Math.cos(direction), radius * Math.sin(direction)]));
      });
    });
  }

  buildCentreGear(view) {
    const { outline } = this.scene, { centre_module: module, pin_circle_radius: circle, housing_radius: end } = outline;
    made("circle", { class: "outline", r: outline.housing_radius }, view);
    const gearOf = (name, bore) => {
      const teeth = outline[`${name}_teeth`], turning = made("g", {}, view), pitch = (module * teeth) / 2;
      this.place(name, "path", { class: "gear-teeth", d: gear(teeth, module, outline.centre_pressure_angle) }, turning);
      made("path", { class: "mark", d: `M${0.7 * pitch} 0L${0.9 * pitch} 0` }, turning);
      return { turning, hole: made("circle", { class: "hole", r: bore }, view), pitch };
    };
    const centre = gearOf("centre", outline.hollow_radius), pinion = gearOf("pinion", 2 * module);
    this.place("centre.mesh", "circle", { class: "mesh", r: 1.1 * module, cx: centre.pitch }, view);
    const inner = circle + 1.6 * outline.pin_radius;
    const output = made("path", { class: "output", d: `M${0.995 * end} 0L${inner} ${0.035 * end}L${inner} ${-0.035 * end}Z` }, view);
    this.painters.push((pose) => {
      centre.turning.setAttribute("transform", moved(pose.centre, pose.at.centre[0]));
      centre.hole.setAttribute("transform", moved(pose.centreAxis));
      pinion.turning.setAttribute("transform", moved(pose.pinion, pose.at.pinion[0]));
      pinion.hole.setAttribute("transform", moved([centre.pitch + pinion.pitch, 0]));
      output.setAttribute("transform", moved([0, 0], pose.output));
    });
  }

  buildLegend() {
    const legend = html("ul", "mechanism-legend", "", this.element);
    for (const [className, text] of [
      ["key-force", "force of a pin on the disc"], ["key-other", "the other discs, modified teeth without errors"],
      ["key-output", "position of the output, turned further by the magnified transmission error"], ["key-share", "share in the output asked about"],
    ]) {
      if (className === "key-other" && this.scene.outline.disc_count === 1) continue;
      const item = html("li", className, "", legend);
      html("span", "key", "", item);
      item.append(text);
    }
    this.stated = html("p", "mechanism-stated", "", this.element);
    for (const sentence of this.scene.assumptions) html("p", "mechanism-assumed", `${sentence[0].toUpperCase()}${sentence.slice(1)}.`, this.element);
  }

  // Drawing ------------------------------------------------------------------------------------------------------

  /** Everything at the present phase, errors magnified. */
  get pose() {
    const { scene, state } = this, { outline, coordinates, offsets } = scene, large = this.magnification;
    const at = positions(scene, this.carrierAngle), q = state.displacement, crankAngle = at.crank[0] - scene.start.crank[0];
    const shift = (first) => [1000 * q[first], 1000 * q[first + 1]];
    const turned = (id, angle) => {
      const [x, y] = offsets[id] ?? [0, 0];
      return [x * Math.cos(angle) - y * Math.sin(angle), x * Math.sin(angle) + y * Math.cos(angle)];
    };
    const across = (radius, direction) => [-radius * Math.sin(direction), radius * Math.cos(direction)];
    const sum = (place, ...ways) => ways.reduce(([x, y], [dx, dy, by = 1]) => [x + large * by * dx, y + large * by * dy], place);
    const carrierAngle = at.carrier[0];
    const planetOf = (crank) => coordinates.planet[crank], discOf = (disc) => coordinates.disc[disc];
    const onCranks = (rows) => rows.slice(0, outline.crank_count); // a single stage has output pins in their place
    const cranks = onCranks(at.cranks).map((own, crank) => sum(own, shift(planetOf(crank))));
    return {
      at, state, magnification: large, cranks, output: carrierAngle + large * state.error,
      journals: onCranks(at.journals).map((row, crank) => row.map((own, disc) => sum(own, shift(planetOf(crank)),
        [...across(outline.eccentricity, at.crank[disc]), q[planetOf(crank) + 2]],
        turned(`crank${crank + 1}.journal${disc + 1}`, crankAngle)))),
      eccentrics: at.discs.map((own, disc) => sum(own, shift(coordinates.sun[0]), turned(`shaft.journal${disc + 1}`, crankAngle))),
      discCentres: at.discs.map((own, disc) => sum(own, shift(discOf(disc)))),
      bores: at.discs.map(([x, y], disc) => at.cranks.map(([cx, cy], crank) => sum([x + cx, y + cy], shift(discOf(disc)),
        [...across(outline.crank_circle_radius, at.carrier[crank]), q[discOf(disc) + 2]],
        turned(`disc${disc + 1}.bore${crank + 1}`, carrierAngle)))),
      ring: at.discs.map((_, disc) => (coordinates.ring ? sum([0, 0], shift(coordinates.ring[disc])) : [0, 0])),
      carrierCentre: sum([0, 0], shift(coordinates.carrier[0])),
      carrierBores: at.cranks.map((own, crank) => sum(own, shift(coordinates.carrier[0]),
        [...across(outline.crank_circle_radius, at.carrier[crank]), q[coordinates.carrier[0] + 2]],
        turned(`carrier.bore${crank + 1}`, carrierAngle))),
      planets: onCranks(at.cranks).map((own, crank) => sum(own, shift(planetOf(crank)), turned(`planet${crank + 1}`, crankAngle))),
      sun: sum([0, 0], shift(coordinates.sun[0]), turned("sun", at.sun[0] - scene.start.sun[0])),
      contacts: at.discs.map((centre, disc) => this.contacts(at, centre, disc, state)),
      ...(at.pinion ? {
        centreAxis: sum([0, 0], shift(coordinates.sun[0])),
        centre: sum([0, 0], shift(coordinates.sun[0]), turned("centre", at.centre[0] - scene.start.centre[0])),
        pinion: sum([(outline.centre_module * (outline.centre_teeth + outline.pinion_teeth)) / 2, 0],
          turned("pinion", at.pinion[0] - scene.start.pinion[0])),
      } : {}),
    };
  }

  /** Where the pins touch a disc: the common normal passes through the point about which disc and housing roll. */
  contacts(at, centre, disc, state) {
    const { outline } = this.scene, roll = outline.eccentricity * outline.pin_count, direction = at.crank[disc];
    const rolling = [roll * Math.cos(direction), roll * Math.sin(direction)];
    return at.pins.map(([x, y], pin) => {
      const way = Math.hypot(rolling[0] - x, rolling[1] - y), normal = [(rolling[0] - x) / way, (rolling[1] - y) / way];
      const point = [x + outline.pin_radius * normal[0], y + outline.pin_radius * normal[1]];
      return {
        normal, point, polar: Math.atan2(point[1] - centre[1], point[0] - centre[0]) - at.disc[disc],
        force: state.force[disc * state.pins + pin], gap: 1000 * state.gap[disc * state.pins + pin],
      };
    });
  }

  draw() {
    const pose = this.pose;
    for (const paint of this.painters) paint(pose);
    this.tell(pose);
    this.handlers.onTurn(degrees(this.carrierAngle) % 360);
  }

  tell(pose) {
    const turn = degrees(this.carrierAngle), own = degrees(pose.state.error) * 3600;
    const seconds = (this.sense > 0 ? this.errorAt?.(turn % 360) : null) ?? own;
    const touching = pose.contacts.map((own, disc) => `${own.filter(({ force }) => force > 0).length || "none"} on disc ${disc + 1}`).join(", ");
    this.stated.textContent =
      `Errors, gaps and displacements are drawn ${short(pose.magnification)} times larger. Carrier at ${turn.toFixed(2)}°, ` +
      `torque ${short(pose.state.torque)} N·m, transmission error ${seconds.toFixed(1).replace("-", "−")}″, pins in contact: ${touching}; ` +
      `the longest arrow of the turn is ${short(this.largest)} N. In one output turn ` +
      (this.scene.outline.output_pin_count ? "the input shaft turns " : `the sun turns ${short(Math.abs(this.scene.turns.sun))} times the same way, the cranks `) +
      `${short(Math.abs(this.scene.turns.crank))} times the other way` +
      (this.scene.turns.pinion ? `, and the input pinion ${short(Math.abs(this.scene.turns.pinion))} times.` : ".");
    if (!this.withControls) return;
    if (document.activeElement !== this.angleInput) this.angleInput.value = String(this.phase);
    this.angleInput.setAttribute("aria-valuetext", `${turn.toFixed(1)} degrees`);
    const factor = String(pose.magnification);
    if (![...this.factorInput.options].some((option) => option.value === factor)) html("option", "", factor, this.factorInput);
    this.factorInput.value = factor;
  }

  showState() {
    if (!this.withControls || !this.playButton) return;
    this.playButton.textContent = this.running !== null ? "Pause" : this.stepwise ? "Step" : "Play";
    this.senseButton.textContent = this.sense > 0 ? "Output turns ↺" : "Output turns ↻";
    this.senseButton.setAttribute("aria-label", `The output turns ${this.sense > 0 ? "counter-clockwise" : "clockwise"}; reverse it`);
  }

  say(id) {
    if (!this.said) return;
    const place = id ? this.labels.get(id) : null;
    if (!place) this.said.textContent = "Point at a part to see which tolerances sit there.";
    else this.said.textContent = `${place.label[0].toUpperCase()}${place.label.slice(1)}: ${place.sources.join(", ") || "no source of the drawing"}`;
  }
}
