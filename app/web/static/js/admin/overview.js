/** How things went: plays and likes by policy and time, and how the service is. */

import { call } from "../api.js";
import { element, percent } from "../dom.js";
import { metrics, sum } from "./metrics.js";
import { card, field, legend, lines, soon, table, tile } from "./parts.js";

const SPANS = { 0.25: "15 minutes", 1: "hour", 6: "6 hours", 24: "day", 168: "week" };
const BUCKETS = 24;
const SHOWN = 4; // policies that are drawn

export function overview(view) {
  const tiles = element("div", { class: "tiles" });
  const chart = element("div");
  const rows = element("div");
  const span = element("select", {}, ...Object.entries(SPANS).map(([hours, name]) => new Option(name, hours)));
  span.value = "1";
  view.append(
    tiles,
    card("Likes by policy", field("The last", span), chart),
    card("Policies", element("p", { class: "hint" }, "Each play counts for the policy that chose it. The plays of one listener count as one cluster."), rows),
  );
  const look = async () => {
    const hours = Number(span.value);
    const [told, counted] = await Promise.all([
      call("/v1/admin/overview", { query: { hours, buckets: BUCKETS } }),
      metrics(),
    ]);
    tiles.replaceChildren(...tilesOf(told, counted));
    chart.replaceChildren(...chartOf(told));
    rows.replaceChildren(tableOf(told));
  };
  span.addEventListener("change", soon(look));
  return look;
}

function tilesOf({ policies, since, until }, counted) {
  const total = (name) => policies.reduce((all, one) => all + one[name], 0);
  const minutes = (new Date(until) - new Date(since)) / 60000;
  const decisions = sum(counted, "encore_decision_seconds_count");
  const took = decisions ? (1000 * sum(counted, "encore_decision_seconds_sum")) / decisions : null;
  const surprises = sum(counted, "encore_surprise_nats_count");
  const surprise = surprises ? sum(counted, "encore_surprise_nats_sum") / surprises : null;
  return [
    tile("Plays a minute", (total("plays") / minutes).toFixed(1)),
    tile("Liked", total("answered") ? percent(total("likes") / total("answered"), 1) : "–"),
    tile("Expected", total("answered") ? percent(total("expected") / total("answered"), 1) : "–"),
    tile("Waiting for an answer", sum(counted, "encore_pending_plays").toFixed(0)),
    tile("Mean decision", took === null ? "–" : `${took.toFixed(2)} ms`),
    tile("Mean surprise, nats", surprise === null ? "–" : surprise.toFixed(3)),
  ];
}

function chartOf({ policies, until, bucket_s: bucket }) {
  const drawn = [...policies].filter((one) => one.answered > 0).sort((a, b) => b.plays - a.plays).slice(0, SHOWN);
  if (drawn.length === 0) return [element("p", { class: "empty" }, "No answers in this time.")];
  const to = new Date(until).getTime();
  const from = to - 1000 * bucket * BUCKETS;
  const series = drawn.map((one) => ({ points: one.buckets.filter((each) => each.answered > 0).map((each) => pointOf(each, bucket)) }));
  const label = `Share of likes: ${drawn.map((one) => `${nameOf(one)} ${percent(one.likes / one.answered)}`).join(", ")}`;
  return [legend(drawn.map(nameOf)), lines(series, { from, to, label })];
}

/** A bucket's share of likes, with Wilson's interval as if its plays were independent. */
function pointOf({ at, likes, answered }, bucket) {
  const [share, z] = [likes / answered, 1.96];
  const shrink = 1 + (z * z) / answered;
  const middle = (share + (z * z) / (2 * answered)) / shrink;
  const half = (z / shrink) * Math.sqrt((share * (1 - share)) / answered + (z / (2 * answered)) ** 2);
  const told = `${percent(share, 1)} of ${answered}, ${new Date(at).toLocaleString()}`;
  return { at: new Date(at).getTime() + 500 * bucket, share, low: Math.max(middle - half, 0), high: Math.min(middle + half, 1), told };
}

function tableOf({ policies }) {
  const rows = policies.map((one) => [
    nameOf(one),
    String(one.users),
    String(one.plays),
    String(one.answered),
    one.like_rate ? percent(one.like_rate.value, 1) : "",
    one.like_rate ? one.like_rate.interval.map((end) => percent(end, 1)).join(" to ") : "",
    one.answered ? percent(one.expected / one.answered, 1) : "",
  ]);
  return table(["Policy", "#Listeners", "#Plays", "#Answered", "#Liked", "#95 %", "#Expected"], rows);
}

const nameOf = ({ version, name }) => (version === null ? "chosen by listeners" : `${name} (version ${version})`);
