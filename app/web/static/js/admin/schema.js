/** A form of what a JSON schema asks for. */

import { element } from "../dom.js";
import { field } from "./parts.js";

/** Fields, and how to read them: those that were left as they are, too. */
export function formOf(schema) {
  const made = Object.entries(schema.properties ?? {})
    .filter(([name]) => name !== "preset")
    .map(([name, property]) => ({ name, ...inputOf(property) }));
  return {
    fields: made.map(({ name, input, about }) => field(name.replaceAll("_", " "), input, about)),
    read: () => Object.fromEntries(made.map(({ name, read }) => [name, read()])),
  };
}

function inputOf(property) {
  const about = [property.description, bounds(property)].filter(Boolean).join("; ");
  const several = property.anyOf?.find((one) => one.type === "array");
  if (several) return { about, ...choiceOf(several.items.enum, [property.default].flat(), true) };
  if (property.enum) return { about, ...choiceOf(property.enum, [property.default], false) };
  if (property.type === "integer" || property.type === "number") return { about, ...numberOf(property) };
  return { about, ...jsonOf(property) };
}

function choiceOf(values, chosen, multiple) {
  const input = element("select", multiple ? { multiple: "", size: String(values.length) } : {});
  input.append(...values.map((value) => new Option(value, value, false, chosen.includes(value))));
  const picked = () => [...input.selectedOptions].map((option) => option.value);
  return { input, read: () => (multiple ? picked() : input.value) };
}

function numberOf({ type, minimum, maximum, default: value }) {
  const step = type === "integer" ? "1" : "any";
  const input = element("input", { type: "number", step, min: minimum, max: maximum });
  input.value = value ?? "";
  return { input, read: () => (input.value === "" ? null : Number(input.value)) };
}

/** What has a form of its own, as a policy to follow, is written as JSON. */
function jsonOf({ default: value }) {
  const input = element("textarea", { spellcheck: "false" });
  input.value = JSON.stringify(value ?? null, null, 1);
  return { input, read: () => JSON.parse(input.value) };
}

function bounds({ minimum, maximum, exclusiveMaximum }) {
  const from = minimum === undefined ? "" : `from ${minimum}`;
  const to = maximum !== undefined ? `to ${maximum}` : exclusiveMaximum === undefined ? "" : `below ${exclusiveMaximum}`;
  return [from, to].filter(Boolean).join(" ");
}
