/** One user: plays, beliefs, why each was chosen; all that is held, and its end. */

import { call } from "../api.js";
import { bar, colour, drawLine, drawTimeline, fill } from "../charts.js";
import { element, percent, shape } from "../dom.js";
import { reason } from "../reasons.js";
import { Titles } from "../titles.js";
import { button, card, field, outcome, soon, table, when } from "./parts.js";

export function users(view, user) {
  const name = element("input", { type: "search", autocomplete: "off" });
  name.value = user;
  name.addEventListener("change", () => {
    location.hash = `#users/${encodeURIComponent(name.value.trim())}`;
  });
  view.append(card("Find", field("User", name, "An id as your application names it.")));
  if (!user) return async () => {};
  const home = `/v1/users/${encodeURIComponent(user)}`;
  const titles = new Titles();
  const beliefs = element("ol", { class: "beliefs" });
  const timeline = timelineOf(home, titles);
  const course = shape("svg", { class: "chart", role: "img" });
  const plays = element("div");
  const why = outcome();
  const told = outcome();
  const explain = (play) => () => why.of(async () => reason(await call(`/v1/plays/${play}`, { query: { explain: true } }), titles), (words) => words || "A play that the listener chose alone.");
  const save = async () => {
    const held = await told.of(() => call(`${home}/export`), () => "All that is held is in the file.");
    if (held) download(held, `${user}.json`);
  };
  const erase = () => {
    if (confirm(`Erase all that is held about ${user}? This cannot be undone.`)) {
      void told.of(() => call(home, { method: "DELETE" }), () => `${user} is erased.`).then(soon(look));
    }
  };
  view.append(
    card("Beliefs", element("p", { class: "hint" }, "Press a title to see how interest in it has moved."), beliefs),
    timeline.place,
    card("Plays", element("p", { class: "hint" }, "The chance of a like that was expected of each of the latest, and the answer."), course, plays, why.place),
    card("All that is held", element("p", { class: "row told" }, button("Export", {}, save), button("Erase", { class: "danger" }, erase)), told.place),
  );
  async function look() {
    const [believed, played] = await Promise.all([
      call(`${home}/beliefs`, { query: { limit: 50 } }),
      call(`${home}/plays`, { query: { limit: 50 } }),
    ]);
    await titles.learn(believed.beliefs.map((one) => one.item));
    beliefs.replaceChildren(...believed.beliefs.map((one) => line(one, titles, timeline.show)));
    await timeline.look(mostPlayed(played.plays));
    drawLine(course, played.plays.toReversed().map((play) => ({ ...play, title: play.title || play.item })));
    plays.replaceChildren(table(["#Slot", "Title", "Answer", "#Expected", "Policy", "When", "Reason"], played.plays.map((play) => row(play, explain))));
  }
  return look;
}

/** The item of most of these plays; of several, the one that was played last. */
function mostPlayed(plays) {
  const count = new Map();
  for (const { item } of plays) count.set(item, (count.get(item) ?? 0) + 1);
  const most = Math.max(...count.values());
  return plays.find(({ item }) => count.get(item) === most)?.item;
}

/** How interest in one item has moved: the one that was pressed, else the usual. */
function timelineOf(home, titles) {
  const title = element("h2");
  const keys = element("ul", { class: "legend" });
  const figure = shape("svg", { class: "chart", role: "img" });
  const about = element("p", { class: "hint" }, "What was believed as each slot began: each colour a state, the line the chance of a like, a dot a play with its answer.");
  const place = element("section", { class: "card", hidden: "" }, title, about, keys, figure);
  let shown = null;
  let usual = null;
  const look = async (found = usual) => {
    usual = found;
    const item = shown ?? usual;
    place.hidden = !item;
    if (!item) return;
    const told = await call(`${home}/items/${encodeURIComponent(item)}/timeline`, { query: { slots: 100 } });
    title.textContent = `Interest in ${titles.of(item)}`;
    keys.replaceChildren(...told.states.map((state, number) => keyOf(state, colour(number, told.states.length))));
    drawTimeline(figure, told);
  };
  const show = (item) => async () => {
    shown = item;
    await soon(look)();
    place.scrollIntoView({ block: "nearest" });
  };
  return { place, look, show };
}

function keyOf(state, colour) {
  const swatch = element("span", { class: "swatch" });
  swatch.style.backgroundColor = colour;
  return element("li", {}, swatch, state);
}

function line(believed, titles, show) {
  const shown = bar(believed.states);
  fill(shown, believed.belief, believed.states);
  const rested = believed.rested === null ? "" : `rested ${believed.rested}`;
  return element(
    "li",
    {},
    button(titles.of(believed.item), { class: "name link" }, show(believed.item)),
    element("strong", {}, percent(believed.like)),
    shown,
    element("span", { class: "note" }, rested),
  );
}

function row(play, explain) {
  const kind = { like: "good", skip: "bad" }[play.signal] ?? "";
  return [
    String(play.slot ?? ""),
    play.title || play.item,
    element("span", { class: `badge ${kind}` }, play.signal ?? "waiting"),
    percent(play.like),
    play.policy === null ? play.source : `version ${play.policy}${play.rung ? `, rung ${play.rung}` : ""}`,
    when(play.created_at),
    button("Why?", { class: "quiet" }, explain(play.play)),
  ];
}

function download(held, name) {
  const link = element("a", { download: name });
  link.href = URL.createObjectURL(new Blob([JSON.stringify(held, null, 1)], { type: "application/json" }));
  link.click();
  URL.revokeObjectURL(link.href);
}
