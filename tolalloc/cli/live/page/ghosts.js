// The same unit in other designs, drawn behind the present one: the pinned designs, or the drawing where none is pinned.

const MOST = 40; // curves that are kept

export class Ghosts {
  constructor() {
    this.known = new Map();
  }

  key({ design }, unit) {
    return JSON.stringify([design, unit]);
  }

  // Series of the figure at a place, of all designs whose unit is known.
  of(designs, unit, place) {
    return designs.flatMap((own) => {
      const figure = this.known.get(this.key(own, unit))?.[place];
      return figure ? [{ ...figure.series.at(-1), label: own.name, ghost: true, colour: own.colour }] : [];
    });
  }

  // Ask for the units that are missing; whether there were any. asked(design, unit) returns figures, or nothing.
  async follow(designs, unit, asked) {
    const missing = designs.filter((own) => !this.known.has(this.key(own, unit)));
    for (const own of missing) {
      const figures = await asked(own.design, unit);
      if (!figures) return false;
      this.known.set(this.key(own, unit), figures);
      while (this.known.size > MOST) this.known.delete(this.known.keys().next().value);
    }
    return missing.length > 0;
  }
}
