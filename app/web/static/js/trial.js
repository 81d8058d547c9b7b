/** What a simulation came to, as figures and a table. */

import { card, table } from "./admin/parts.js";
import { element } from "./dom.js";
import { curvesOf, legendOf, sharesOf } from "./figures.js";

const about = (value, half, digits = 3) => `${value.toFixed(digits)} ± ${half.toFixed(digits)}`;

/** Cards; `more`: children of the first two, by name. */
export function reportOf(result, more = {}) {
  return [
    card("Earned by then", legendOf(result), curvesOf(result), element("p", { class: "hint" }, `Means of ${result.runs} users; bands hold them in 95 of 100. A reward counts ${result.discount} times the one before.`), ...(more.curves ?? [])),
    card("What was played", sharesOf(result), ...(more.shares ?? [])),
    card("In numbers", tableOf(result), element("p", { class: "hint" }, limit(result))),
  ];
}

function tableOf({ policies }) {
  const rows = policies.map((one, number) => [
    one.label,
    about(one.mean, one.ci95),
    number === 0 ? "" : about(one.difference, one.difference_ci95),
    one.gap_percent === null ? "" : `${Math.max(one.gap_percent, 0).toFixed(1)} %`,
    one.decision_us < 1000 ? `${one.decision_us.toFixed(0)} µs` : `${(one.decision_us / 1000).toFixed(1)} ms`,
  ]);
  return table(["Policy", "#Reward", "#To the first", "#Below the bound", "#A decision"], rows);
}

const limit = ({ bound, reason }) =>
  bound === null ? `No bound: ${reason}` : `No policy earns more than ${bound.toFixed(3)} on average.`;
