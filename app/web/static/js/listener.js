/** The player: a play, two answers, and what Encore believes meanwhile. */

import { Away, Problem, call, patiently } from "./api.js";
import { bar, colour, drawLine, fill } from "./charts.js";
import { key } from "./door.js";
import { byId, element, percent } from "./dom.js";
import { firstSteps } from "./first.js";
import { compare } from "./plans.js";
import { reason } from "./reasons.js";
import { Titles } from "./titles.js";

const USER = "encore.listener";
const FORECAST = 100; // slots
const BACK = 0.9; // of the chance that it had when it was played

const titles = new Titles();
const rows = new Map();
const returns = new Map(); // slot at which an item is back
let session = [];
let present = null;

function user() {
  const asked = new URLSearchParams(location.search).get("user");
  if (asked) return asked;
  if (!sessionStorage.getItem(USER)) anew();
  return sessionStorage.getItem(USER);
}

function anew() {
  const name = crypto.getRandomValues(new Uint16Array(1))[0].toString(16).padStart(4, "0");
  sessionStorage.setItem(USER, `guest-${name}`);
}

const home = () => `/v1/users/${encodeURIComponent(user())}`;

/** Do it; ask for another key where this one is refused, and say what else is wrong. */
async function attempt(work) {
  for (;;) {
    try {
      return await work();
    } catch (error) {
      if (!(error instanceof Problem || error instanceof Away)) throw error;
      if (![401, 403].includes(error.status)) return explain(error);
      await key(error.message);
    }
  }
}

function explain(error) {
  if (error.code === "nothing_to_play") {
    byId("title").textContent = "Nothing to play yet";
    byId("first-steps").replaceChildren(...firstSteps(attempt, begin));
    byId("first-steps").hidden = false;
  } else {
    tell(error.message);
  }
  return null;
}

const tell = (message) => {
  byId("notice").textContent = message;
};

const insist = (path, options) => patiently(() => call(path, options), { tell });

async function begin() {
  await key();
  session = [];
  rows.clear();
  returns.clear();
  byId("beliefs").replaceChildren();
  byId("listener").textContent = user();
  const play = await attempt(() => insist(`${home()}/next`));
  if (play) show(play.plays?.[0] ?? play);
}

function show(play) {
  present = { ...play, signal: null };
  titles.know(play.item, play.title);
  session.push(present);
  tell("");
  byId("first-steps").hidden = true;
  byId("slot").textContent = `Play ${play.slot + 1}, chosen by ${play.policy.name}`;
  byId("title").textContent = play.title || play.item;
  byId("tags").replaceChildren(...play.tags.map((tag) => element("span", { class: "tag" }, tag)));
  byId("chance").textContent = percent(play.like);
  byId("meter").setAttribute("aria-valuenow", Math.round(100 * play.like));
  byId("meter-fill").style.width = `${100 * play.like}%`;
  for (const [id, signal] of answers()) byId(id).setAttribute("data-signal", signal);
  ready(true);
  drawLine(byId("line"), session);
  void attempt(() => look(play));
}

/** The two buttons, and the signals of least and most interest that they stand for. */
const answers = () => [
  ["skip", present.signals[0]],
  ["like", present.signals.at(-1)],
];

function ready(isReady) {
  for (const id of ["skip", "like"]) byId(id).disabled = !isReady;
}

/** What is believed now, why this was chosen, and what others would play. */
async function look(play) {
  const [beliefs, record] = await Promise.all([
    call(`${home()}/beliefs`, { query: { limit: 100 } }),
    call(`/v1/plays/${play.play}`, { query: { explain: true } }),
  ]);
  if (play.play !== present.play) return; // another one is shown by now
  byId("why").textContent = await reason(record, titles);
  await showBeliefs(beliefs);
  await compare(home(), titles);
}

async function answer(id) {
  if (byId(id).disabled) return;
  ready(false);
  const { play, item, like } = present;
  const signal = byId(id).dataset.signal;
  present.signal = id;
  drawLine(byId("line"), session);
  const taken = await attempt(() =>
    insist(`/v1/plays/${play}/feedback`, { method: "POST", body: { signal }, query: { next: true } }),
  );
  void foresee(item, like);
  const next = taken?.next ?? (await attempt(() => insist(`${home()}/next`)));
  if (next) show(next.plays?.[0] ?? next);
}

/** When is what was just played back? */
async function foresee(item, like) {
  const path = `${home()}/items/${encodeURIComponent(item)}/forecast`;
  const seen = await attempt(() => call(path, { query: { slots: FORECAST, threshold: BACK * like } }));
  if (seen) returns.set(item, seen.back_in === null ? Infinity : seen.slot + seen.back_in);
}

async function showBeliefs({ beliefs, slot }) {
  byId("no-beliefs").hidden = beliefs.length > 0;
  if (beliefs.length > 0) showLegend(beliefs[0].states);
  await titles.learn(beliefs.map((one) => one.item));
  for (const believed of beliefs) {
    const row = rows.get(believed.item) ?? addRow(believed);
    fill(row.bar, believed.belief, believed.states);
    row.like.textContent = percent(believed.like);
    row.note.textContent = noteOf(believed, slot);
    row.line.classList.toggle("latest", believed.rested === 0);
  }
}

function addRow({ item, states }) {
  const row = {
    bar: bar(states),
    like: element("strong"),
    note: element("span", { class: "note" }),
  };
  const name = element("span", { class: "name" }, titles.of(item));
  row.line = element("li", {}, name, row.like, row.bar, row.note);
  rows.set(item, row);
  byId("beliefs").prepend(row.line);
  return row;
}

function noteOf({ item, rested }, slot) {
  const ago = rested === 0 ? "just played" : `rested ${rested}`;
  const back = returns.get(item);
  if (back === undefined || back <= slot) return ago;
  return back === Infinity ? `${ago}, back in over ${FORECAST}` : `${ago}, back in ${back - slot}`;
}

function showLegend(states) {
  if (byId("legend").children.length === states.length) return;
  byId("legend").replaceChildren(
    ...states.map((state, number) => {
      const swatch = element("span", { class: "swatch" });
      swatch.style.backgroundColor = colour(number, states.length);
      return element("li", {}, swatch, state);
    }),
  );
}

for (const id of ["skip", "like"]) byId(id).addEventListener("click", () => answer(id));
byId("anew").addEventListener("click", () => {
  anew();
  history.replaceState(null, "", location.pathname);
  void begin();
});
document.addEventListener("keydown", (event) => {
  const id = { ArrowLeft: "skip", ArrowRight: "like" }[event.key];
  const typing = event.target.closest("input, select, textarea, dialog");
  if (!id || typing || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  void answer(id);
});
for (const side of ["a", "b"]) {
  byId(`policy-${side}`).addEventListener("change", () => attempt(() => compare(home(), titles)));
}
void begin();
