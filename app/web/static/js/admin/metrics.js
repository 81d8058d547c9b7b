/** What the service counts, as Prometheus reads it. */

const LINE = /^(\w+)(?:\{(.*)\})? (\S+)$/;

/** The sum of all series of a metric whose labels hold a text. */
export const sum = (text, name, labels = "") =>
  series(text, name)
    .filter((one) => one.labels.includes(labels))
    .reduce((total, one) => total + Number(one.value), 0);

/** A label of a metric's first series. */
export function labelOf(text, name, label) {
  const [first] = series(text, name);
  return new RegExp(`\\b${label}="([^"]*)"`).exec(first?.labels)?.[1];
}

const series = (text, name) =>
  text
    .split("\n")
    .map((line) => LINE.exec(line))
    .filter((found) => found?.[1] === name)
    .map(([, , labels = "", value]) => ({ labels, value }));

export async function metrics() {
  const answer = await fetch(new URL("metrics", document.baseURI)).catch(() => null);
  return answer?.ok ? answer.text() : "";
}
