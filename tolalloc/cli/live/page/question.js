// Ranking and allocation from the page: how far they are, what they found, and of which design.

import { ask, refusable } from "./requests.js";
import { make } from "./zones.js";

const at = (id) => document.getElementById(id);
const EVERY = 500; // ms between two looks at how far it is
const NAMES = { ranking: "What drives it", allocation: "Cheapest drawing" };
const count = (value) => value.toLocaleString("en-US");

// How far a question is: its stage, and what is done and left of that and of all.
export function progress({ stage, units, expected, counted, seconds, solved, most }) {
  const known = expected > units, left = known ? ` of ${count(expected)} ${counted}, ${count(expected - units)} left` : ` ${counted}`;
  const all = most > solved ? `; in all ${count(solved)} done, at most ${count(most - solved)} left` : "";
  return `${stage}${units || known ? `: ${count(units)}${left}` : ""}${all}; ${seconds.toFixed(0)} s`;
}

export class Question {
  // asked() returns design and locked sources; answered(answer, design) takes over what was found.
  constructor({ asked, answered, draw, take }) {
    Object.assign(this, { asked, answered, draw, take, design: null, taken: null, running: 0 });
    at("ask-ranking").addEventListener("click", () => this.ask("ranking"));
    at("ask-allocation").addEventListener("click", () => this.ask("allocation"));
    at("stop").addEventListener("click", () => refusable(ask("stop")));
  }

  async ask(kind) {
    const { design, locked } = this.asked(), own = ++this.running;
    this.design = this.taken = null;
    at("found").replaceChildren();
    at("asked").textContent = `${NAMES[kind]}: begins`;
    let state = await refusable(ask("ask", { question: kind, design, locked }));
    while (state && !state.answer && !state.error && own === this.running) {
      this.tell(kind, state);
      await new Promise((done) => setTimeout(done, EVERY));
      state = await refusable(ask("state"));
      if (state && !state.kind) state.error = "The server was restarted: ask again.";
    }
    if (own !== this.running) return; // a newer question took its place
    at("stop").hidden = at("asked-bar").hidden = true;
    if (!state) return void (at("asked").textContent = `${NAMES[kind]}: not asked.`);
    if (state.error) return void (at("asked").textContent = state.error === "stopped" ? "Stopped." : state.error);
    at("asked").textContent = `${NAMES[kind]}, at the quick effort: answered in ${state.seconds.toFixed(0)} s.`;
    this.design = design;
    this.show(kind, state.answer);
    this.answered(state.answer, design);
  }

  tell(kind, state) {
    at("stop").hidden = at("asked-bar").hidden = false;
    at("asked").textContent = `${NAMES[kind]}: ${progress(state)}${state.told ? `. ${state.told}` : ""}`;
    if (state.most > state.solved) Object.assign(at("asked-bar"), { max: state.most, value: state.solved });
    else at("asked-bar").removeAttribute("value");
  }

  show(kind, { sentences, warnings, figure, zones, settings }) {
    const told = sentences.map((text) => make("p", {}, text)), rest = told.splice(3);
    at("found").replaceChildren(
      ...(zones ? [make("button", { onclick: () => this.taken = this.take(zones, settings) }, "Take this drawing")] : []),
      make("p", { class: "earlier", hidden: true }, "This is the answer for an earlier design, not for the one that is shown now."),
      ...told, ...(rest.length ? [make("details", {}, make("summary", {}, "more of the answer"), ...rest)] : []),
      ...warnings.map((text) => make("p", { class: "warning" }, text)));
    if (figure) this.draw(figure);
  }

  // What was found belongs to the design it was asked of.
  belongs(design) {
    const other = this.design !== null && ![this.design, this.taken].some((own) => JSON.stringify(design) === JSON.stringify(own));
    at("found").classList.toggle("older", other);
    for (const own of at("found").querySelectorAll(".earlier")) own.hidden = !other;
  }
}
