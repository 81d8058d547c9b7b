/** Items: listed, looked for, edited, imported with the errors by line. */

import { call, send } from "../api.js";
import { element } from "../dom.js";
import { firstSteps } from "../first.js";
import { button, card, field, outcome, soon, table } from "./parts.js";

const KINDS = { csv: "text/csv", ndjson: "application/x-ndjson" };

export function items(view) {
  const rows = element("div");
  const search = element("input", { type: "search", autocomplete: "off" });
  const editor = editorOf(soon(() => look()));
  const file = element("input", { type: "file", accept: ".csv,.ndjson,.jsonl" });
  const imported = outcome();
  const bring = (dry) => async () => {
    const chosen = file.files[0];
    if (!chosen) return imported.of(async () => Promise.reject(new Error("Choose a file first.")));
    const kind = KINDS[chosen.name.endsWith(".csv") ? "csv" : "ndjson"];
    await imported.of(
      () => send("/v1/items/import", { method: "POST", query: { dry_run: dry }, body: chosen, type: kind }),
      (found) => `${dry ? "Would be" : "Is"} done: ${Object.entries(found).map(([name, value]) => `${name} ${value}`).join(", ")}.`,
    );
    await soon(look)();
  };
  search.addEventListener("input", soon(() => look()));
  view.append(
    editor.place,
    card(
      "Import",
      element("p", { class: "hint" }, "CSV (id, model, title, tags, payload) or NDJSON. All lines are taken, or none."),
      element("div", { class: "row" }, field("File", file), button("Try it", {}, bring(true)), button("Import", { class: "primary" }, bring(false))),
      imported.place,
    ),
    card("Items", field("Find", search, "By id or title; press an id to edit."), rows),
  );
  async function look() {
    const asked = search.value.trim();
    const { items: found, next } = await call("/v1/items", { query: { limit: 100, search: asked } });
    if (asked !== search.value.trim()) return; // another one is looked for by now
    const shown = found.map((item) => [
      button(item.id, { class: "quiet" }, () => editor.open(item.id)),
      item.title,
      item.model,
      item.tags.join(", "),
    ]);
    if (found.length === 0 && !asked) {
      if (!rows.querySelector("button")) rows.replaceChildren(...firstSteps((work) => work(), soon(look)));
      return;
    }
    rows.replaceChildren(
      table(["Id", "Title", "Model", "Tags"], shown),
      element("p", { class: "hint" }, next ? "The first 100; find others by id or title." : `${found.length} items.`),
    );
  }
  return look;
}

function editorOf(changed) {
  const title = element("h2");
  const fields = element("div", { class: "told" });
  const told = outcome();
  const place = element("section", { class: "card", hidden: "" }, title, fields, told.place);
  const open = async (id) => {
    title.textContent = id;
    fields.replaceChildren();
    place.hidden = false;
    const item = await told.of(() => call(`/v1/items/${encodeURIComponent(id)}`), () => "");
    if (item === null) return;
    const name = element("input", { maxlength: "500" });
    const model = element("input");
    const tags = element("input");
    const payload = element("textarea", { spellcheck: "false" });
    [name.value, model.value, tags.value] = [item.title, item.model, item.tags.join(", ")];
    payload.value = JSON.stringify(item.payload, null, 1);
    const path = `/v1/items/${encodeURIComponent(id)}`;
    const form = () => ({
      title: name.value,
      model: model.value,
      tags: tags.value.split(",").map((tag) => tag.trim()).filter(Boolean),
      payload: JSON.parse(payload.value),
    });
    const save = () => told.of(async () => call(path, { method: "PUT", body: form() }), () => `${id} is saved.`).then(changed);
    const retire = () => {
      if (confirm(`Retire ${id}? It is offered no more; its history stays.`)) {
        void told.of(() => call(path, { method: "DELETE" }), () => `${id} is retired.`).then(changed);
      }
    };
    fields.replaceChildren(
      element("div", { class: "fields" }, field("Title", name), field("Model", model), field("Tags", tags, "with commas between them")),
      field("Payload", payload),
      element("p", { class: "row told" }, button("Save", { class: "primary" }, save), button("Retire", { class: "danger" }, retire)),
    );
    name.focus();
  };
  return { place, open };
}
