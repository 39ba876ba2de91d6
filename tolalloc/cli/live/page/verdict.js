// What random units say, in words.

import { number } from "./chart.js";
import { make } from "./zones.js";

// What is named of an output: the value that so many units stay below, or above where only little is not allowed.
export const named = (share) => `${number(100 * Math.max(share, 1 - share))} % of units ${share < 0.5 ? "above" : "below"}`;
export const percent = (share) => `${(100 * share).toFixed(2)} %`;

export function quantile(own, { share, value, interval }) {
  const limit = share < 0.5 ? own.lower : own.upper, beyond = value !== null && (share < 0.5 ? value < limit : value > limit);
  const [low, high] = interval.map((end) => (end === null ? null : number(Number(end.toPrecision(4)))));
  const known = low !== null && high !== null ? `${low} … ${high} (95 %)` : low !== null ? `at least ${low} (95 %); an upper bound needs more units` : high !== null ? `at most ${high} (95 %); a lower bound needs more units` : "bounds need more units";
  return make("div", { class: "of-units quantile" }, make("dt", {}, `${own.name}, ${named(share)}`),
    make("dd", { class: beyond ? "bad" : "" }, `${value === null ? "–" : number(Number(value.toPrecision(4)))} ${own.unit}`),
    make("dd", { class: "small" }, known));
}

// Whether the limits are kept, as far as the units tell, and how many units do not work at all.
export function verdict(judged) {
  const [, low, high] = judged.yield;
  const free = Object.entries(judged.broken).map(([output, share]) => {
    const units = share ? `${percent(share)} of the units are` : "No unit is";
    return output.startsWith("largest pin force without torque") ? ` ${units} preloaded${share ? ": without torque their pin forces exceed those of the rated torque" : ""}.` : ` ${units} beyond the model's own limit of ${output}.`;
  }).join("");
  if (low >= judged.target) return `The limits are kept: the yield is at least the ${percent(judged.target)} asked for.${free}`;
  if (high < judged.target) return `The limits are not kept: the yield is below the ${percent(judged.target)} asked for.${free}`;
  return `These units leave it open whether the yield is the ${percent(judged.target)} asked for; a run confirms it.${free}`;
}
