/** What the service counts, as Prometheus reads it. */

const LINE = /^(\w+)(?:\{(.*)\})? (\S+)$/;

/** The sum of all series of a metric whose labels hold a text. */
export function sum(text, name, labels = "") {
  return text
    .split("\n")
    .map((line) => LINE.exec(line))
    .filter((found) => found && found[1] === name && (found[2] ?? "").includes(labels))
    .reduce((total, found) => total + Number(found[3]), 0);
}

export async function metrics() {
  const answer = await fetch(new URL("metrics", document.baseURI)).catch(() => null);
  return answer?.ok ? answer.text() : "";
}
