/** How the service is: ready or not, the guard, deadlines, errors. */

import { call } from "../api.js";
import { element, percent } from "../dom.js";
import { labelOf, metrics, sum } from "./metrics.js";
import { card, table, tile, when } from "./parts.js";

export function health(view) {
  const state = element("div");
  const tiles = element("div", { class: "tiles" });
  const guard = element("div");
  view.append(card("Ready", state), tiles, card("The guard", guard));
  return async () => {
    const [ready, counted, judged] = await Promise.all([readiness(), metrics(), call("/v1/admin/guard")]);
    state.replaceChildren(...shown(ready));
    tiles.replaceChildren(...tilesOf(counted));
    guard.replaceChildren(...guardOf(judged));
  };
}

/** 503 is an answer, too. */
async function readiness() {
  const answer = await fetch(new URL("health/ready", document.baseURI));
  return answer.json();
}

function shown({ status, reasons }) {
  const kind = status === "ready" ? "good" : "bad";
  return [
    element("p", {}, element("span", { class: `badge ${kind}` }, status)),
    ...reasons.map((one) => element("p", { class: "wrong" }, one.detail)),
  ];
}

function tilesOf(counted) {
  const degraded = (cause) => sum(counted, "encore_decisions_degraded_total", `cause="${cause}"`);
  return [
    tile("Release", labelOf(counted, "encore_build_info", "version") ?? "–"),
    tile("Processes", `${sum(counted, "encore_workers_ready")} of ${sum(counted, "encore_workers")}`),
    tile("Failed requests", String(sum(counted, "encore_errors_total", 'code="internal_error"'))),
    tile("Refused or failed", String(sum(counted, "encore_errors_total"))),
    tile("Decisions foretold slow", String(degraded("slow"))),
    tile("Decisions late", String(degraded("late"))),
    tile("Decisions failed", String(degraded("failed"))),
    tile("Waiting to be written", String(sum(counted, "encore_queued_units"))),
    tile("Memory", `${(sum(counted, "encore_memory_bytes") / 1e6).toFixed(0)} MB`),
    tile("Index tables to build", String(sum(counted, "encore_index_tables_waiting"))),
  ];
}

function guardOf(judged) {
  const rows = judged.models.map((one) => [
    one.model,
    String(one.version),
    element("span", { class: `badge ${one.state === "calm" ? "good" : "bad"}` }, one.state),
    String(one.answers),
    one.scores ? one.scores.excess.toFixed(4) : "",
    one.scores ? percent(one.scores.predicted, 1) : "",
    one.scores ? percent(one.scores.answered, 1) : "",
    when(one.since),
  ]);
  return [
    element("p", { class: "hint" }, `The guard is set to “${judged.mode}”.`),
    rows.length
      ? table(["Model", "#Version", "State", "#Answers", "#Excess loss", "#Predicted", "#Liked", "Since"], rows)
      : element("p", { class: "empty" }, "It has judged no model yet."),
  ];
}
