/** Two policies side by side: what each would play next, believing the same. */

import { call } from "./api.js";
import { byId, element, percent } from "./dom.js";

const LENGTH = 6;
const IN_FORCE = "";

/** Plan anew with both policies that are chosen. */
export async function compare(home, titles) {
  await listPolicies();
  await Promise.all(["a", "b"].map((side) => plan(home, titles, side)));
}

async function listPolicies() {
  if (byId("policy-a").options.length > 0) return;
  const { policies } = await call("/v1/policies");
  for (const [side, chosen] of [["a", IN_FORCE], ["b", "myopic"]]) {
    const select = byId(`policy-${side}`);
    select.append(new Option("the one in force", IN_FORCE));
    for (const { name, summary } of policies) {
      const option = new Option(name, name);
      option.title = summary;
      select.append(option);
    }
    select.value = chosen;
  }
}

async function plan(home, titles, side) {
  const name = byId(`policy-${side}`).value;
  const policy = name === IN_FORCE ? null : { name };
  const body = { length: LENGTH, repeats: true, policy };
  const { plays } = await call(`${home}/playlist`, { method: "POST", body });
  if (byId(`policy-${side}`).value !== name) return; // another one is asked for by now
  const shown = plays.filter((play) => !play.pending);
  shown.forEach((play) => titles.know(play.item, play.title));
  const lines = shown.map((play) =>
    element("li", {}, element("span", {}, titles.of(play.item)), element("strong", {}, percent(play.like))),
  );
  byId(`plan-${side}`).replaceChildren(...lines);
}
