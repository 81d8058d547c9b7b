/** Calls of the API, with the key that this tab was given. */

const KEPT = "encore.key";

/** What the service said instead of doing it: an RFC 9457 problem. */
export class Problem extends Error {
  constructor(status, problem) {
    const fields = (problem.errors ?? []).map((one) => `${one.field}: ${one.message}`);
    super([problem.detail ?? problem.title ?? `Status ${status}`, ...fields].join(" "));
    this.status = status;
    this.title = problem.title ?? "";
    this.errors = problem.errors ?? [];
    this.code = problem.code;
    this.retryAfter = 1000 * (problem.retryAfter ?? 0);
  }
}

/** The service does not answer at all. */
export class Away extends Error {}

/** A key that came behind the # of the address, which is not sent to any server. */
export function takeKey() {
  const given = new URLSearchParams(location.hash.slice(1)).get("key");
  if (given) {
    keepKey(given);
    history.replaceState(null, "", location.pathname + location.search);
  }
  return sessionStorage.getItem(KEPT);
}

export const keepKey = (key) => sessionStorage.setItem(KEPT, key.trim());

/** Call the API with a form; the answer's JSON. Raises Problem or Away. */
export function call(path, { method = "GET", body, query } = {}) {
  const form = body === undefined ? {} : { body: JSON.stringify(body), type: "application/json" };
  return send(path, { method, query, ...form });
}

/** The same with a body of any type. */
export async function send(path, options) {
  const answer = await request(path, options);
  if (answer.status === 204) return {};
  return answer.json().catch(() => {
    throw new Away("The service went away.");
  });
}

/** Call what answers with a line of JSON after the other; each as it comes. */
export async function* lines(path, { method, body, signal }) {
  const answer = await request(path, { method, body: JSON.stringify(body), type: "application/json", signal });
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read().catch((error) => {
      throw signal?.aborted ? error : new Away("The service went away.");
    });
    if (done) return;
    const whole = (rest + value).split("\n");
    rest = whole.pop();
    for (const line of whole) yield JSON.parse(line);
  }
}

async function request(path, { method, body, type, query, signal } = {}) {
  const address = new URL(path.replace(/^\//, ""), document.baseURI);
  for (const [name, value] of Object.entries(query ?? {})) {
    for (const one of [value].flat()) address.searchParams.append(name, one);
  }
  const headers = { Authorization: `Bearer ${sessionStorage.getItem(KEPT) ?? ""}` };
  if (type !== undefined) headers["Content-Type"] = type;
  let answer;
  try {
    answer = await fetch(address, { method, headers, body, signal });
  } catch (error) {
    throw signal?.aborted ? error : new Away("The service does not answer.");
  }
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({}));
  throw new Problem(answer.status, { ...told, retryAfter: answer.headers.get("Retry-After") });
}

/** Do it until it is done: what is away, or asks for patience, is asked again. */
export async function patiently(work, { tell, signal }) {
  for (let wait = 500; ; wait = Math.min(2 * wait, 8000)) {
    try {
      return await work();
    } catch (error) {
      const passes = error instanceof Away || [429, 503].includes(error.status);
      if (!passes || signal?.aborted) throw error;
      tell(`${error.message} Trying again ...`);
      await new Promise((done) => setTimeout(done, Math.max(wait, error.retryAfter ?? 0)));
    }
  }
}
