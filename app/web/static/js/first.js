/** The first steps of an empty service. */

import { call, send } from "./api.js";
import { element } from "./dom.js";

/** What to do where there are no items; `attempt` asks for another key if need be. */
export function firstSteps(attempt, done) {
  const told = element("p", { class: "notice", role: "status", "aria-live": "polite" });
  const button = element("button", { type: "button" }, "Bring the demo's catalogue");
  button.addEventListener("click", async () => {
    button.disabled = true;
    told.textContent = "Importing ...";
    try {
      if (await attempt(bringDemo)) done();
    } catch (error) {
      told.textContent = error.message;
    } finally {
      button.disabled = false;
    }
  });
  return [
    element(
      "p",
      { class: "notice" },
      element("a", { href: "admin#models" }, "Models"),
      " say how interest moves, ",
      element("a", { href: "admin#items" }, "items"),
      " are what is played: import both. Or look around with 65 invented items, which you can retire later.",
    ),
    button,
    told,
  ];
}

/** The catalogue that `encore demo` brings; to do so again changes nothing. */
async function bringDemo() {
  const [models, items] = await Promise.all(["models", "items"].map(file));
  for (const line of models.trim().split("\n")) {
    const { id, ...form } = JSON.parse(line);
    await call(`/v1/models/${encodeURIComponent(id)}`, { method: "PUT", body: form });
  }
  return send("/v1/items/import", { method: "POST", body: items, type: "application/x-ndjson" });
}

const file = async (name) => (await fetch(new URL(`static/demo/${name}.ndjson`, document.baseURI))).text();
