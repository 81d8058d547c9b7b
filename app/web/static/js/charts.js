/** Beliefs as stacked bars, and a session as a line. */

import { across, element, percent, shape } from "./dom.js";

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
  const [width, height, left, bottom] = [across(640), 220, 48, 16];
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

/** A belief slot after slot, as stacked columns; a dot where the item was played. */
export function drawTimeline(svg, { states, timeline }) {
  const [width, height, left, top, bottom] = [across(860), 260, 48, 24, 24];
  const step = Math.min((width - left - 10) / timeline.length, 40);
  const x = (number) => left + step * number;
  const y = (share) => top + (height - bottom - top) * (1 - share);
  const columns = timeline.flatMap(({ belief }, number) => {
    let below = 0;
    return belief.toReversed().map((chance, place) => {
      below += chance;
      const fill = colour(states.length - 1 - place, states.length);
      return shape("rect", { x: x(number), width: step + 0.3, y: y(below), height: y(below - chance) - y(below), fill, "shape-rendering": "crispEdges" });
    });
  });
  const dots = timeline.flatMap(({ slot, like, signals }, number) =>
    signals.map((signal) =>
      shape("circle", { cx: x(number) + step / 2, cy: top / 2, r: Math.min(step / 2, 5), class: `dot ${signal}` }, shape("title", {}, `slot ${slot}: ${signal}; ${percent(like)} expected`)),
    ),
  );
  const points = timeline.map(({ like }, number) => `${x(number) + step / 2},${y(like)}`).join(" ");
  const shares = [0, 0.5, 1].map((share) => shape("text", { x: left - 6, y: y(share) + 4, class: "tick", "text-anchor": "end" }, percent(share)));
  const ends = [[timeline[0].slot, left, "start"], ["now", x(timeline.length), "end"]];
  const slots = timeline.length > 4 ? ends : ends.slice(1);
  const ticks = slots.map(([text, at, anchor]) => shape("text", { x: at, y: height - 4, class: "tick", "text-anchor": anchor }, String(text)));
  const [first, last] = [timeline[0], timeline.at(-1)];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", `Chance of a like from slot ${first.slot}, ${percent(first.like)}, to now, ${percent(last.like)}; played ${dots.length} times`);
  svg.replaceChildren(...columns, shape("polyline", { points, class: "line over" }), ...dots, ...shares, ...ticks);
}

function told(plays) {
  const answered = plays.filter((play) => play.signal);
  if (answered.length === 0) return "No plays yet";
  const liked = answered.filter((play) => play.signal !== "skip").length;
  const mean = answered.reduce((sum, play) => sum + play.like, 0) / answered.length;
  return `${answered.length} plays, ${liked} liked; ${percent(mean)} were expected`;
}
