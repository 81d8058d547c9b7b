/** The lab: policies tried on simulated users; what was asked is in the address. */

import { Problem, call } from "./api.js";
import { key } from "./door.js";
import { byId, element } from "./dom.js";
import { standalone } from "./figures.js";
import { simulate } from "./simulations.js";
import { reportOf } from "./trial.js";

const FIELDS = ["example", "start", "runs", "slots", "discount", "seed"];
const USUAL = ["myopic", "exact_rollout", "whittle"];

let choices = [];
let running = null;

/** One policy: its name, its parameters, a way out. */
function contender({ name, params = "" }) {
  const choice = element("select", { "aria-label": "Policy" }, ...choices.map((one) => new Option(one.name, one.name)));
  choice.value = name;
  const given = element("input", { "aria-label": "Parameters", placeholder: "parameters", autocomplete: "off", spellcheck: "false" });
  given.value = params;
  const away = element("button", { type: "button", class: "quiet", "aria-label": "Leave it out" }, "✕");
  const row = element("li", {}, choice, given, away);
  away.addEventListener("click", () => row.remove());
  byId("policies").append(row);
}

const contenders = () =>
  [...byId("policies").children].map((row) => ({ name: row.children[0].value, params: row.children[1].value.trim() }));

/** What is asked, as a form of the API; raises what is wrong with it. */
function asked() {
  const number = (id) => (byId(id).value === "" ? null : Number(byId(id).value));
  return {
    example: number("example"),
    start: byId("start").value,
    runs: number("runs"),
    slots: number("slots"),
    discount: number("discount"),
    seed: number("seed"),
    policies: contenders().map(({ name, params }) => ({ name, params: params ? parsed(params) : {} })),
  };
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    throw new SyntaxError(`Parameters are JSON, as {"horizon": 5}: ${text}`);
  }
}

function address() {
  const query = new URLSearchParams(FIELDS.map((id) => [id, byId(id).value]).filter(([id, value]) => value !== "" || id === "example"));
  for (const { name, params } of contenders()) query.append("policy", params ? `${name}=${params}` : name);
  return `${location.pathname}?${query}`;
}

/** Fill the form with what the address asks for; whether it asks for anything. */
function recall() {
  const query = new URLSearchParams(location.search);
  for (const id of FIELDS) if (query.has(id)) byId(id).value = query.get(id);
  const named = query.getAll("policy").map((text) => {
    const [name, ...params] = text.split("=");
    return { name, params: params.join("=") };
  });
  byId("policies").replaceChildren();
  for (const each of named.length > 0 ? named : USUAL.map((name) => ({ name }))) contender(each);
  return named.length > 0;
}

async function run() {
  running?.abort();
  const mine = (running = new AbortController());
  busy(true);
  byId("result").replaceChildren();
  try {
    const form = asked();
    const result = await attempt(() => simulate(form, { signal: mine.signal, tell }));
    tell(`${result.runs} users with ${result.slots} plays each.`);
    show(result);
  } catch (error) {
    if (mine !== running) return; // another one has begun
    if (mine.signal.aborted) tell("Stopped.");
    else if (error instanceof Problem || error instanceof SyntaxError) tell(error.message);
    else throw error;
  } finally {
    if (mine === running) busy(false);
  }
}

/** Do it; ask for another key where this one is refused. */
async function attempt(work) {
  for (;;) {
    try {
      return await work();
    } catch (error) {
      if (![401, 403].includes(error.status)) throw error;
      await key(error.message);
    }
  }
}

function tell(text, share) {
  byId("notice").textContent = text;
  byId("progress").value = share ?? 0;
}

function busy(is) {
  byId("stop").disabled = !is;
  byId("progress").hidden = !is;
}

function show(result) {
  const made = {
    curves: [download("Figure as SVG", "encore-curves.svg", "image/svg+xml", (card) => standalone(card.querySelector("svg.chart")))],
    shares: [download("Figure as SVG", "encore-shares.svg", "image/svg+xml", (card) => standalone(card.querySelector("svg.chart")))],
  };
  const numbers = download("All of it as CSV", "encore-simulation.csv", "text/csv", () => csvOf(result));
  byId("result").replaceChildren(...reportOf(result, made));
  byId("result").lastChild.append(numbers);
}

function download(text, name, type, make) {
  const button = element("button", { type: "button", class: "quiet" }, text);
  button.addEventListener("click", () => {
    const url = URL.createObjectURL(new Blob([make(button.closest(".card"))], { type }));
    element("a", { href: url, download: name }).click();
    URL.revokeObjectURL(url);
  });
  return button;
}

/** A row for each value: what it is, of which policy, and where. */
function csvOf({ policies, slots_shown: slots, models, bound }) {
  const rows = [["policy", "value", "at", "mean", "half_width_95"]];
  if (bound !== null) rows.push(["", "bound", "", bound, ""]);
  for (const one of policies) {
    rows.push([one.label, "reward", "", one.mean, one.ci95], [one.label, "difference", "", one.difference, one.difference_ci95]);
    models.forEach((model, place) => rows.push([one.label, "play_share", model, one.play_shares[place], ""]));
    slots.forEach((slot, place) => rows.push([one.label, "earned_by_slot", slot, one.curve[place], 1.96 * one.curve_error[place]]));
  }
  return `${rows.map((row) => row.map(quoted).join(",")).join("\r\n")}\r\n`;
}

const quoted = (value) => (/[",\r\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value));

async function begin() {
  await key();
  choices = (await attempt(() => call("/v1/policies"))).policies;
  if (recall()) void run();
}

byId("add").addEventListener("click", () => contender({ name: "myopic" }));
byId("stop").addEventListener("click", () => running.abort());
byId("form").addEventListener("submit", (event) => {
  event.preventDefault();
  history.replaceState(null, "", address());
  void run();
});
void begin();
