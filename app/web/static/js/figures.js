/** Figures of simulations: what was earned by then, and what was played. */

import { across, element, percent, shape } from "./dom.js";

const KEYS = 6; // colours
const DASHES = ["", "9 5", "2 4", "9 4 2 4"];
const [WIDTH, LEFT, RIGHT, TOP, BOTTOM] = [across(860), 62, 16, 12, 44];
const HEIGHT = 380;
const BAR = 16;
const NORMAL = 1.96;

/** Lines that run over each other differ in colour and in dashes. */
const keyOf = (number) => `key-${number % KEYS}`;
const dashOf = (number) => DASHES[number % DASHES.length];

/** Cumulative reward by slot, with 95 % bands and what no policy exceeds. */
export function curvesOf({ policies, slots_shown: slots, bound }) {
  const ends = policies.map(({ curve, curve_error: error }) => curve.at(-1) + NORMAL * error.at(-1));
  const most = Math.max(bound ?? 0, ...ends) * 1.04 || 1;
  const x = (slot) => LEFT + ((WIDTH - LEFT - RIGHT) * slot) / slots.at(-1);
  const y = (reward) => TOP + (HEIGHT - TOP - BOTTOM) * (1 - reward / most);
  const svg = figure(WIDTH, HEIGHT, `Reward earned by slot: ${policies.map((one) => `${one.label} ${one.mean.toFixed(2)}`).join(", ")}`);
  for (const reward of ticks(most)) {
    svg.append(
      shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(reward), y2: y(reward), class: "grid" }),
      text(LEFT - 8, y(reward) + 4, String(reward), "end"),
    );
  }
  for (const slot of ticks(slots.at(-1))) svg.append(text(x(slot), HEIGHT - BOTTOM + 20, String(slot), "middle"));
  svg.append(
    text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 6, "slots", "middle"),
    shape("text", { transform: `translate(14 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)`, class: "tick", "text-anchor": "middle" }, "discounted likes earned"),
  );
  if (bound !== null) {
    svg.append(
      shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(bound), y2: y(bound), class: "limit" }),
      text(LEFT + 8, y(bound) + 16, "no policy exceeds this in the end", "start"),
    );
  }
  policies.forEach(({ curve, curve_error: error, label }, number) => {
    const at = (sign) => slots.map((slot, place) => `${x(slot)},${y(curve[place] + sign * NORMAL * error[place])}`);
    svg.append(
      shape("polygon", { points: [...at(1), ...at(-1).reverse()].join(" "), class: `band ${keyOf(number)}` }),
      shape("polyline", { points: [`${x(0)},${y(0)}`, ...at(0)].join(" "), class: `curve ${keyOf(number)}`, "stroke-dasharray": dashOf(number) || null }, shape("title", {}, label)),
    );
  });
  return svg;
}

/** Shares of plays by model: a group of bars for each, one for every policy. */
export function sharesOf({ policies, models, items }) {
  const rows = models.map((model, place) => ({ model, items: items[place], shares: policies.map((one) => one.play_shares[place]) }));
  const most = Math.max(...rows.flatMap((row) => row.shares)) || 1;
  const names = 190;
  const high = policies.length * BAR + 12;
  const svg = figure(WIDTH, rows.length * high + 12, "Shares of plays by model");
  rows.forEach(({ model, items: count, shares }, place) => {
    const top = 6 + place * high;
    svg.append(text(names - 10, top + high / 2, short(count > 1 ? `${model} (${count} items)` : model), "end"));
    shares.forEach((share, number) => {
      const long = ((WIDTH - names - 70) * share) / most;
      const told = shape("title", {}, `${policies[number].label}: ${percent(share, 1)}`);
      svg.append(
        shape("rect", { x: names, y: top + number * BAR, width: Math.max(long, 1), height: BAR - 3, class: `block ${keyOf(number)}` }, told),
        text(names + long + 6, top + number * BAR + 11, percent(share, share < 0.1 ? 1 : 0), "start"),
      );
    });
  });
  return svg;
}

/** Which line is whose. */
export const legendOf = ({ policies }) =>
  element(
    "ul",
    { class: "legend" },
    ...policies.map(({ label }, number) => {
      const line = shape("line", { x1: 0, x2: 30, y1: 6, y2: 6, class: `curve ${keyOf(number)}`, "stroke-dasharray": dashOf(number) || null });
      return element("li", {}, shape("svg", { width: 30, height: 12, "aria-hidden": "true" }, line), label);
    }),
  );

/** A figure as a file that needs no style sheet. */
export function standalone(svg) {
  const copy = svg.cloneNode(true);
  const parts = [svg, ...svg.querySelectorAll("*")];
  [copy, ...copy.querySelectorAll("*")].forEach((part, number) => {
    const style = getComputedStyle(parts[number]);
    for (const name of STYLED) part.setAttribute(name, style.getPropertyValue(name));
    part.removeAttribute("class");
  });
  const [width, height] = svg.getAttribute("viewBox").split(" ").slice(2);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  copy.prepend(shape("rect", { width, height, fill: getComputedStyle(svg).getPropertyValue("--card") }));
  return new XMLSerializer().serializeToString(copy);
}
const STYLED = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "font-family", "font-size"];

const figure = (width, height, label) =>
  shape("svg", { class: "chart", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });

const text = (x, y, said, anchor) => shape("text", { x, y, class: "tick", "text-anchor": anchor }, said);

const short = (name) => (name.length > 24 ? `${name.slice(0, 23)}…` : name);

/** Round numbers from 0 up to a limit, about five of them. */
function ticks(limit) {
  const rough = limit / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough);
  return Array.from({ length: Math.floor(limit / step) + 1 }, (_, number) => Number((number * step).toPrecision(6)));
}
