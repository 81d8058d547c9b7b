/** One user: plays, beliefs, why each was chosen; all that is held, and its end. */

import { call } from "../api.js";
import { bar, drawLine, fill } from "../charts.js";
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
    card("Beliefs", beliefs),
    card("Plays", element("p", { class: "hint" }, "The chance of a like that was expected of each of the latest, and the answer."), course, plays, why.place),
    card("All that is held", element("p", { class: "row told" }, button("Export", {}, save), button("Erase", { class: "danger" }, erase)), told.place),
  );
  async function look() {
    const [believed, played] = await Promise.all([
      call(`${home}/beliefs`, { query: { limit: 50 } }),
      call(`${home}/plays`, { query: { limit: 50 } }),
    ]);
    await titles.learn(believed.beliefs.map((one) => one.item));
    beliefs.replaceChildren(...believed.beliefs.map((one) => line(one, titles)));
    drawLine(course, played.plays.toReversed().map((play) => ({ ...play, title: play.title || play.item })));
    plays.replaceChildren(table(["#Slot", "Title", "Answer", "#Expected", "Policy", "When", "Reason"], played.plays.map((play) => row(play, explain))));
  }
  return look;
}

function line(believed, titles) {
  const shown = bar(believed.states);
  fill(shown, believed.belief, believed.states);
  const rested = believed.rested === null ? "" : `rested ${believed.rested}`;
  return element(
    "li",
    {},
    element("span", { class: "name" }, titles.of(believed.item)),
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
