/** The operator's page: views by the name behind the #, kept up to date while seen. */

import { Away, Problem } from "./api.js";
import { key } from "./door.js";
import { byId, element } from "./dom.js";
import { experiments } from "./admin/experiments.js";
import { health } from "./admin/health.js";
import { items } from "./admin/items.js";
import { models } from "./admin/models.js";
import { overview } from "./admin/overview.js";
import { policy } from "./admin/policy.js";
import { users } from "./admin/users.js";

const EVERY = 5000; // milliseconds between looks
const SLOWEST = 60000;
const VIEWS = { overview, policy, experiments, models, items, users, health };
const TITLES = {
  overview: "Overview",
  policy: "Policy",
  experiments: "Experiments",
  models: "Models",
  items: "Items",
  users: "Users",
  health: "Health",
};

let timer;
let shown = 0;
let wait = EVERY;

const named = () => {
  const [name] = location.hash.slice(1).split("/");
  return name in VIEWS ? name : "overview";
};

/** What follows the view's name: a user, an item. */
const about = () => decodeURIComponent(location.hash.slice(1).split("/").slice(1).join("/"));

async function show() {
  const number = ++shown;
  clearTimeout(timer);
  await key();
  for (const link of byId("views").children) {
    if (link.dataset.view === named()) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  const view = element("div", { class: "column" }, element("h1", {}, TITLES[named()]));
  const look = VIEWS[named()](view, about());
  byId("view").replaceChildren(view);
  await keepLooking(look, number);
}

/** Look again and again, less often while nobody answers, and not while nobody sees it. */
async function keepLooking(look, number) {
  if (number !== shown) return;
  if (!document.hidden) await lookOnce(look);
  if (number === shown) timer = setTimeout(() => keepLooking(look, number), wait);
}

async function lookOnce(look) {
  try {
    await look();
    wait = EVERY;
    byId("state").textContent = "";
  } catch (error) {
    if (error instanceof Problem && [401, 403].includes(error.status)) {
      await key(error.message);
    } else if (error instanceof Problem || error instanceof Away) {
      wait = Math.min(2 * wait, SLOWEST);
      byId("state").textContent = `${error.message} Trying again ...`;
    } else {
      throw error;
    }
  }
}

byId("views").append(
  ...Object.keys(VIEWS).map((name) => element("a", { href: `#${name}`, "data-view": name }, TITLES[name])),
);
addEventListener("hashchange", () => void show());
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) void show();
});
void show();
