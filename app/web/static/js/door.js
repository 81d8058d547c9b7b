/** Asks for a key where there is none, or where it is refused. */

import { keepKey, takeKey } from "./api.js";
import { byId } from "./dom.js";

/** A key, asked for if need be. `wrong`: why the one that there was will not do. */
export async function key(wrong = "") {
  const kept = takeKey();
  if (kept && !wrong) return kept;
  const door = byId("door");
  byId("door-wrong").textContent = wrong;
  byId("key").value = "";
  door.showModal();
  await new Promise((done) => {
    byId("door-form").addEventListener("submit", done, { once: true });
    door.addEventListener("cancel", (event) => event.preventDefault());
  });
  keepKey(byId("key").value);
  return takeKey();
}
