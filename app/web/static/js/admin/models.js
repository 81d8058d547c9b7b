/** Models: matrices as heat maps, and what a play and a rest do to interest. */

import { call } from "../api.js";
import { element, percent } from "../dom.js";
import { card, legend, lines, table } from "./parts.js";

const SLOTS = 30;

export function models(view) {
  const list = element("div");
  view.append(list);
  let seen = "";
  return async () => {
    const [{ models: found }, { models: judged }] = await Promise.all([
      call("/v1/models", { query: { limit: 50 } }),
      call("/v1/admin/guard"),
    ]);
    const now = JSON.stringify([found.map((one) => [one.id, one.version]), judged]);
    if (now === seen) return;
    const indexes = await Promise.all(found.map(({ id }) => call(`/v1/models/${encodeURIComponent(id)}/index`)));
    seen = now;
    list.className = "column";
    const all = found.map((one, place) => shown(one, indexes[place], judged.find(({ model }) => model === one.id)));
    list.replaceChildren(...(found.length ? all : [element("p", { class: "empty" }, "There are no models yet.")]));
  };
}

function shown(model, index, judged) {
  const played = course(model, model.play);
  const rested = course(model, model.rest);
  const label = `Chance of a like over ${SLOTS} slots: played each time, to ${percent(played.at(-1).share)}; rested, to ${percent(rested.at(-1).share)}`;
  return card(
    `${model.id}, version ${model.version}`,
    element("p", { class: "hint" }, model.source ? `From ${model.source}. ` : "", `${model.states.length} states; signals ${model.signals.join(", ")}.`),
    element("p", {}, ...trust(index), " ", calibration(judged)),
    ...model.warnings.map((warning) => element("p", { class: "wrong" }, warning)),
    element("div", { class: "matrices" }, heat("When played", model.play, model.states), heat("When resting", model.rest, model.states)),
    table(["State", "#At first", "#Likes"], model.states.map((state, number) => [state, percent(model.prior[number], 1), percent(model.like[number], 1)])),
    element("h3", {}, "After a like of a listener who was at the highest state"),
    legend(["played in every slot", "resting"]),
    chart([{ points: played }, { points: rested }], label),
  );
}

/** Whether a Whittle index of this model can be trusted. */
function trust({ indexable, state }) {
  if (indexable === null) return [element("span", { class: "badge" }, `index table: ${state}`)];
  return [element("span", { class: `badge ${indexable ? "good" : "bad"}` }, indexable ? "indexable" : "not indexable")];
}

/** What it foretold of plays that were answered, beside what was answered. */
function calibration(judged) {
  if (!judged?.scores) return "Too few answers to judge its forecasts.";
  const { predicted, answered, excess } = judged.scores;
  return `Of ${judged.answers} answers it foretold ${percent(predicted, 1)} likes, and ${percent(answered, 1)} were; ${excess > 0 ? "worse" : "better"} than simpler guesses by ${Math.abs(excess).toFixed(4)} nats.`;
}

/** Expected likes, from the state that likes most, under one matrix for ever. */
function course({ like }, matrix) {
  let belief = like.map((chance) => (chance === Math.max(...like) ? 1 : 0));
  const points = [];
  for (let slot = 0; slot <= SLOTS; slot++) {
    const share = belief.reduce((total, chance, state) => total + chance * like[state], 0);
    points.push({ at: slot, share, low: share, high: share, told: `${slot}: ${percent(share, 1)}` });
    belief = belief.map((_, to) => belief.reduce((total, chance, from) => total + chance * matrix[from][to], 0));
  }
  return points;
}

function chart(series, label) {
  const drawn = lines(series, { from: 0, to: SLOTS, label });
  const ticks = [...drawn.querySelectorAll("text")].slice(-3);
  ticks.forEach((tick, number) => {
    tick.textContent = String((SLOTS * number) / 2);
  });
  return drawn;
}

function heat(title, matrix, states) {
  const rows = matrix.map((row, from) =>
    element("tr", {}, element("th", { scope: "row" }, states[from]), ...row.map(cell)),
  );
  const head = element("tr", {}, element("td"), ...states.map((state) => element("th", { scope: "col" }, state)));
  return element("div", {}, element("h3", {}, title), element("table", { class: "heat" }, element("thead", {}, head), element("tbody", {}, ...rows)));
}

function cell(chance) {
  const made = element("td", {}, chance.toFixed(2));
  made.style.backgroundColor = `color-mix(in srgb, var(--accent) ${Math.round(40 * chance)}%, var(--card))`;
  return made;
}
