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
export async function send(path, { method, body, type, query } = {}) {
  const address = new URL(path.replace(/^\//, ""), document.baseURI);
  for (const [name, value] of Object.entries(query ?? {})) {
    for (const one of [value].flat()) address.searchParams.append(name, one);
  }
  const headers = { Authorization: `Bearer ${sessionStorage.getItem(KEPT) ?? ""}` };
  if (type !== undefined) headers["Content-Type"] = type;
  let answer;
  try {
    answer = await fetch(address, { method, headers, body });
  } catch {
    throw new Away("The service does not answer.");
  }
  const told = await answer.json().catch(() => ({}));
  if (answer.ok) return told;
  throw new Problem(answer.status, { ...told, retryAfter: answer.headers.get("Retry-After") });
}

/** Call until it is done: what is away, or asks for patience, is asked again. */
export async function callPatiently(path, options, tell) {
  for (let wait = 500; ; wait = Math.min(2 * wait, 8000)) {
    try {
      return await call(path, options);
    } catch (error) {
      const passes = error instanceof Away || [429, 503].includes(error.status);
      if (!passes) throw error;
      tell(`${error.message} Trying again ...`);
      await new Promise((done) => setTimeout(done, Math.max(wait, error.retryAfter ?? 0)));
    }
  }
}
