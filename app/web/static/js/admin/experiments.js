/** The experiment that runs, or the last one; those before. */

import { call } from "../api.js";
import { element, percent } from "../dom.js";
import { button, card, outcome, soon, table, when } from "./parts.js";

const EXAMPLE = {
  name: "look-ahead",
  arms: [
    { name: "control", share: 0.45 },
    { name: "myopic", policy: { name: "myopic" }, share: 0.45 },
  ],
  holdout: 0.1,
  note: "is planning ahead worth it?",
};

export function experiments(view) {
  const latest = element("div");
  const past = element("div");
  const told = outcome();
  const form = element("textarea", { "aria-label": "Experiment, as JSON", spellcheck: "false" });
  form.value = JSON.stringify(EXAMPLE, null, 1);
  const put = () =>
    told
      .of(async () => call("/v1/admin/experiment", { method: "PUT", body: JSON.parse(form.value) }), (one) => `“${one.name}” runs, as version ${one.version}.`)
      .then(soon(look));
  const end = () => {
    if (confirm("End the experiment? The policy in force then serves all listeners.")) {
      void told.of(() => call("/v1/admin/experiment", { method: "DELETE" }), (one) => `“${one.name}” has ended.`).then(soon(look));
    }
  };
  view.append(
    card("The latest", latest),
    card(
      "Begin or change",
      element("p", { class: "hint" }, "Shares and holdout add up to 1. An arm without a policy is served by the one in force. The same name changes the one that runs."),
      form,
      element("p", { class: "row told" }, button("Begin or change", { class: "primary" }, put), button("End it", { class: "danger" }, end)),
      told.place,
    ),
    card("All versions", past),
  );
  async function look() {
    const { experiments: all } = await call("/v1/admin/experiments", { query: { limit: 20 } });
    const rows = all.map((one) => [String(one.version), one.name, when(one.started_at), when(one.ended_at), one.note]);
    const found = all.length ? shown(await call("/v1/admin/experiment")) : [element("p", { class: "empty" }, "There was none yet.")];
    latest.replaceChildren(...found);
    past.replaceChildren(table(["#Version", "Name", "From", "To", "Why"], rows));
  }
  return look;
}

function shown(found) {
  const state = found.running ? (found.suspended ? "suspended by the guard" : "runs") : "has ended";
  const arms = found.arms.map((arm) => [
    arm.name === found.control ? `${arm.name} (control)` : arm.name,
    arm.policy?.name ?? "the one in force",
    percent(arm.share),
    String(arm.users),
    String(arm.answered),
    arm.like_rate ? `${percent(arm.like_rate.value, 1)} (${ends(arm.like_rate)})` : "",
    arm.difference ? `${percent(arm.difference.value, 1)} (${ends(arm.difference)})` : "",
    arm.difference ? arm.difference.p.toPrecision(2) : "",
  ]);
  const shadows = found.shadows.map((one) => [
    one.name,
    one.policy.name,
    String(one.decisions),
    one.agreement ? percent(one.agreement.value, 1) : "",
    one.gain ? `${percent(one.gain.value, 1)} (${ends(one.gain)})` : "",
  ]);
  return [
    element("p", {}, element("strong", {}, found.name), ` ${state}, since ${when(found.started_at)}. ${found.note}`),
    ...found.warnings.map((warning) => element("p", { class: "wrong" }, warning)),
    table(["Arm", "Policy", "#Share", "#Listeners", "#Answered", "#Liked", "#To the control", "#p, at any time"], arms),
    ...(shadows.length ? [table(["Shadow", "Policy", "#Decisions", "#Agrees", "#Expected gain in a play"], shadows)] : []),
    element("p", { class: "hint" }, `Counted until ${when(found.counted_until) || "nothing yet"}.`),
  ];
}

const ends = ({ interval }) => interval.map((end) => percent(end, 1)).join(" to ");
