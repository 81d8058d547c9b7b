/** Beliefs as stacked bars, and a session as a line. */

import { element, percent, shape } from "./dom.js";

const LOW = [148, 163, 184];
const MIDDLE = [56, 149, 211];
const HIGH = [109, 40, 217];

/** The colour of a state among several, from little interest to much. */
export function colour(number, states) {
  const place = states > 1 ? (2 * number) / (states - 1) : 2;
  const [from, to] = place < 1 ? [LOW, MIDDLE] : [MIDDLE, HIGH];
  const share = place < 1 ? place : place - 1;
  const mixed = from.map((value, channel) => Math.round(value + share * (to[channel] - value)));
  return `rgb(${mixed.join(" ")})`;
}

/** A bar in which each state has the width of its chance. */
export function bar(states) {
  return element(
    "div",
    { class: "bar", role: "img" },
    ...states.map((_, number) => {
      const part = element("span");
      part.style.backgroundColor = colour(number, states.length);
      return part;
    }),
  );
}

/** Show a belief in its bar; the widths move there. */
export function fill(bar, belief, states) {
  belief.forEach((chance, number) => {
    bar.children[number].style.flexGrow = chance;
  });
  const told = states.map((state, number) => `${state} ${percent(belief[number])}`);
  bar.setAttribute("aria-label", told.join(", "));
}

/** The plays of a session: what was expected, and what was answered. */
export function drawLine(svg, plays) {
  const [width, height, left, bottom] = [640, 220, 48, 16];
  const last = Math.max(plays.length - 1, 9);
  const x = (number) => left + ((width - left - 10) * number) / last;
  const y = (like) => 8 + (height - bottom - 8) * (1 - like);
  const grid = [0, 0.5, 1].flatMap((like) => [
    shape("line", { x1: left, x2: width - 6, y1: y(like), y2: y(like), class: "grid" }),
    shape("text", { x: left - 6, y: y(like) + 4, class: "tick", "text-anchor": "end" }, percent(like)),
  ]);
  const points = plays.map((play, number) => `${x(number)},${y(play.like)}`);
  const dots = plays.map((play, number) =>
    shape(
      "circle",
      { cx: x(number), cy: y(play.like), r: 5, class: `dot ${play.signal ?? "open"}` },
      shape("title", {}, `${play.title}: ${percent(play.like)}, ${play.signal ?? "not answered yet"}`),
    ),
  );
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", told(plays));
  svg.replaceChildren(...grid, shape("polyline", { points: points.join(" "), class: "line" }), ...dots);
}

function told(plays) {
  const answered = plays.filter((play) => play.signal);
  if (answered.length === 0) return "No plays yet";
  const liked = answered.filter((play) => play.signal !== "skip").length;
  const mean = answered.reduce((sum, play) => sum + play.like, 0) / answered.length;
  return `${answered.length} plays, ${liked} liked; ${percent(mean)} were expected`;
}
