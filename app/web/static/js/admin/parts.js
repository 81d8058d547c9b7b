/** Parts that views are made of. */

import { Away, Problem } from "../api.js";
import { across, element, shape } from "../dom.js";

export const card = (title, ...children) =>
  element("section", { class: "card" }, element("h2", {}, title), ...children);

export const tile = (name, value) =>
  element("div", { class: "tile" }, element("span", {}, name), element("strong", {}, value));

export const button = (text, attributes, act) => {
  const made = element("button", { type: "button", ...attributes }, text);
  made.addEventListener("click", act);
  return made;
};

/** A table of rows; names of columns that begin with # hold numbers. */
export function table(columns, rows) {
  const kind = (column) => (column.startsWith("#") ? { class: "number" } : {});
  const head = columns.map((column) =>
    element("th", { scope: "col", ...kind(column) }, column.replace("#", "")),
  );
  const body = rows.map((row) =>
    element("tr", {}, ...row.map((cell, place) => element("td", kind(columns[place]), ...[cell].flat()))),
  );
  return element(
    "div",
    { class: "scroll", tabindex: "0", role: "group", "aria-label": "Table" },
    element("table", {}, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...body)),
  );
}

/** A labelled input; `about` says what it is for. */
export function field(label, input, about = "") {
  const id = `field-${++fields}`;
  input.id = id;
  return element("div", {}, element("label", { for: id }, label), input, about && element("small", {}, about));
}
let fields = 0;

/** A place for what came of an action. */
export function outcome() {
  const place = element("div", { class: "told", role: "status", "aria-live": "polite" });
  return {
    place,
    /** Do it, and say what came of it; what is refused names its fields. */
    async of(work, done) {
      place.className = "told";
      place.textContent = "...";
      try {
        const found = await work();
        place.textContent = done(found);
        return found;
      } catch (error) {
        place.classList.add("wrong");
        place.textContent = error.message;
        if (error instanceof Problem && error.errors.length > 1) place.replaceChildren(error.title, list(error.errors));
        return null;
      }
    },
  };
}

const list = (errors) =>
  element("ul", {}, ...errors.map((one) => element("li", {}, `${one.field}: ${one.message}`)));

/** Look at once, out of turn; what fails is told when it is looked at the next time. */
export const soon = (look) => async () => {
  try {
    await look();
  } catch (error) {
    if (!(error instanceof Problem || error instanceof Away)) throw error;
  }
};

export const when = (moment) => (moment ? new Date(moment).toLocaleString() : "");

/** Shares over time as lines, with what surely holds them as bands. */
export function lines(series, { from, to, label }) {
  const [width, height, left, bottom] = [across(860), 240, 48, 24];
  const x = (moment) => left + ((width - left - 10) * (moment - from)) / (to - from);
  const y = (share) => 8 + (height - bottom - 8) * (1 - share);
  const svg = shape("svg", { class: "chart", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    svg.append(
      shape("line", { x1: left, x2: width - 6, y1: y(share), y2: y(share), class: "grid" }),
      shape("text", { x: left - 6, y: y(share) + 4, class: "tick", "text-anchor": "end" }, `${100 * share} %`),
    );
  }
  for (const moment of [from, (from + to) / 2, to]) {
    const anchor = moment === to ? "end" : moment === from ? "start" : "middle";
    const text = new Date(moment).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
    svg.append(shape("text", { x: x(moment), y: height - 4, class: "tick", "text-anchor": anchor }, text));
  }
  series.forEach(({ points }, number) => {
    const at = points.map((point) => `${x(point.at)},${y(point.share)}`).join(" ");
    svg.append(shape("polyline", { points: at, class: `line key-${number % 4}` }));
    for (const point of points) {
      svg.append(
        shape("line", { x1: x(point.at), x2: x(point.at), y1: y(point.low), y2: y(point.high), class: `span key-${number % 4}` }),
        shape("circle", { cx: x(point.at), cy: y(point.share), r: 3, class: `dot key-${number % 4}` }, shape("title", {}, point.told)),
      );
    }
  });
  return svg;
}

export const legend = (names) =>
  element(
    "ul",
    { class: "legend" },
    ...names.map((name, number) => element("li", {}, element("span", { class: `swatch key-${number % 4}` }), name)),
  );
