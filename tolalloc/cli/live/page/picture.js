// The moving reducer of the unit that is shown: it lights what a row names, and is shaded by what a ranking said.

import { Mechanism } from "./mechanism.js";
import { ask, refusable } from "./requests.js";

const at = (id) => document.getElementById(id);

export class Picture {
  // asked() returns the record of the scene to show.
  // onTurn(angle) is called when it turns; errorAt(angle) is the error of the curve [arcsec] at an angle of the carrier [°].
  constructor(study, zones, asked, { onTurn, errorAt }) {
    Object.assign(this, { study, zones, asked, onTurn, errorAt, mechanism: null, shown: "", pictured: "", busy: false, angle: 0 });
  }

  // The picture is that of an earlier design or unit until it has followed.
  belongs() {
    at("moving").classList.toggle("older", Boolean(this.mechanism) && JSON.stringify(this.asked()) !== this.pictured);
  }

  get runs() {
    return Boolean(this.mechanism) && this.mechanism.running !== null;
  }

  // Stand at an angle of the carrier [°].
  turnTo(angle) {
    this.angle = angle;
    if (this.runs) this.mechanism.pause();
    if (at("moving").open) this.mechanism?.turnTo(angle);
  }

  get places() {
    return this.mechanism?.scene.places ?? [];
  }

  // It follows once the hand rests, and a swept error at once; only the newest of several is drawn.
  async follow() {
    if (this.busy || at("moving").dataset.none) return;
    this.busy = true;
    for (let key; at("moving").open && (key = JSON.stringify(this.asked())) !== this.shown; this.shown = key) {
      const found = await refusable(ask("scene", JSON.parse(key)));
      if (!found) continue;
      this.show(found.scene);
      this.pictured = key;
    }
    this.busy = false;
    this.belongs();
  }

  show(scene) {
    at("moving").hidden = !scene;
    if (!scene) return void (at("moving").dataset.none = "yes");
    if (this.mechanism) this.mechanism.update(scene);
    else this.begin(scene);
    this.shade();
  }

  begin(scene) {
    const { angle } = this, onPoint = (id) => this.zones.light(this.sourcesAt(id)), onChoose = (id) => this.goTo(this.sourcesAt(id));
    const onTurn = (now) => {
      this.angle = now;
      this.onTurn(now);
    };
    this.mechanism = new Mechanism(at("mechanism"), scene, { onPoint, onChoose, onTurn, errorAt: this.errorAt });
    this.mechanism.turnTo(angle);
  }

  sourcesAt(id) {
    return this.places.find((place) => place.id === id)?.sources ?? [];
  }

  goTo([source]) {
    const own = this.study.sources.find((item) => item.name === source);
    if (own) this.zones.rows.get(own.group)?.scrollIntoView({ block: "center" });
  }

  light(names) {
    this.mechanism?.light(this.places.filter((place) => place.sources.some((own) => names.includes(own))).map((place) => place.id));
  }

  // Places take the colour of what their sources contribute, as far as a ranking has said it.
  shade() {
    const { shares } = this.zones;
    if (!this.mechanism || !shares) return;
    const most = Math.max(...Object.values(shares), 1e-9);
    this.mechanism.shade(Object.fromEntries(this.places.map((place) => [place.id, place.sources.reduce((sum, own) => sum + (shares[own] ?? 0), 0) / most])));
  }
}
