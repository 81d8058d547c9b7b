/** Elements, made without markup in strings: what comes from outside stays text. */

const SVG = "http://www.w3.org/2000/svg";

export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; those that are text stay text. */
export function element(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** The same for SVG. */
export function shape(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

/** The width of a figure: on a phone half as wide, so that its words stay readable. */
export const across = (wide) => (window.innerWidth < 640 ? wide / 2 : wide);

export const percent = (share, digits = 0) => `${(100 * share).toFixed(digits)} %`;

function filled(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}
