/** The policy in force: seen, swapped by a form of its own parameters, rolled back. */

import { call } from "../api.js";
import { element } from "../dom.js";
import { simulate } from "../simulations.js";
import { reportOf } from "../trial.js";
import { button, card, field, outcome, soon, table, when } from "./parts.js";
import { formOf } from "./schema.js";

const RUNS = 300; // simulated users that try a policy

export function policy(view) {
  const present = element("div");
  const history = element("div");
  const told = outcome();
  const choice = element("select");
  const fields = element("div", { class: "fields" });
  const note = element("input", { maxlength: "1000", autocomplete: "off" });
  let choices = [];
  let form = null;

  const choose = () => {
    const chosen = choices.find((one) => one.name === choice.value);
    form = formOf(chosen.params);
    fields.replaceChildren(...form.fields);
    summary.textContent = chosen.summary;
  };
  const summary = element("p", { class: "hint" });
  const tried = element("div", { class: "column" });
  const bar = element("progress", { max: "1", "aria-label": "Progress", hidden: "" });
  const first = button("Try it first", {}, async () => {
    const wanted = { policies: [{ name: choice.value, params: form.read() }], runs: RUNS };
    first.disabled = true;
    bar.hidden = false;
    tried.replaceChildren();
    const tell = (text, share) => {
      told.place.textContent = text;
      bar.value = share ?? 0;
    };
    const result = await told.of(
      () => simulate(wanted, { tell }),
      ({ runs, slots }) => `${runs} simulated users, new to the catalogue, with ${slots} plays each.`,
    );
    if (result) tried.replaceChildren(...reportOf(result));
    bar.hidden = true;
    first.disabled = false;
  });
  const swap = () =>
    told
      .of(
        () => call("/v1/admin/policy", { method: "PUT", body: { name: choice.value, params: form.read(), note: note.value } }),
        (found) => `${found.name} is in force, as version ${found.version}.`,
      )
      .then(soon(look));
  const rollBack = () =>
    told
      .of(
        () => call("/v1/admin/policy/rollback", { method: "POST", body: { note: note.value } }),
        (found) => `${found.name} is in force again, as version ${found.version}.`,
      )
      .then(soon(look));
  choice.addEventListener("change", choose);
  view.append(
    card("In force", present),
    card(
      "Swap",
      field("Policy", choice),
      summary,
      fields,
      field("Why", note, "Kept in the history."),
      element("p", { class: "row told" }, first, button("Put in force", { class: "primary" }, swap), button("Roll back to the one before", { class: "danger" }, rollBack)),
      bar,
      told.place,
      tried,
    ),
    card("History", history),
  );
  async function look() {
    if (choices.length === 0) {
      choices = (await call("/v1/policies")).policies;
      choice.append(...choices.map((one) => new Option(one.name, one.name)));
    }
    const [now, past] = await Promise.all([call("/v1/admin/policy"), call("/v1/admin/policies", { query: { limit: 20 } })]);
    if (form === null) {
      choice.value = now.name;
      choose();
    }
    present.replaceChildren(...shown(now));
    history.replaceChildren(
      table(
        ["#Version", "Policy", "Parameters", "Since", "By", "Why"],
        past.policies.map((one) => [String(one.version), one.name, params(one.params), when(one.activated_at), one.by, one.note]),
      ),
    );
  }
  return look;
}

const params = (values) => element("code", {}, JSON.stringify(values));

function shown({ name, version, params: values, rungs, tables, warnings, activated_at: at, by }) {
  const parts = [
    element("p", {}, element("strong", {}, name), ` version ${version}, since ${when(at)}, by ${by}`),
    element("p", {}, params(values)),
  ];
  if (rungs?.length) parts.push(element("p", { class: "hint" }, `If it is too slow or fails: ${rungs.map((one) => one.name).join(", then ")}.`));
  if (tables) parts.push(element("p", { class: "hint" }, `Index tables: ${tables.ready} of ${tables.of} ready, ${tables.rough} rough.`));
  parts.push(...warnings.map((warning) => element("p", { class: "wrong" }, warning)));
  return parts;
}
