/** Titles of items, each asked for once. */

import { call } from "./api.js";

export class Titles {
  #known = new Map();

  know(item, title) {
    this.#known.set(item, title || item);
  }

  of(item) {
    return this.#known.get(item) ?? item;
  }

  async learn(items) {
    const missing = [...new Set(items)].filter((item) => item && !this.#known.has(item));
    const found = await Promise.all(
      missing.map((item) => call(`/v1/items/${encodeURIComponent(item)}`)),
    );
    found.forEach((item) => this.know(item.id, item.title));
  }
}
