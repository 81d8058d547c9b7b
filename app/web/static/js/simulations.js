/** Simulations: asked for, watched, and asked for again if the service went away. */

import { Away, lines, patiently } from "./api.js";

const STAGES = { bound: "What could be earned at most", tables: "Getting ready", users: "Simulating users" };

/**
 * What came of a simulation. Its `form` alone decides on that, so that it can be asked
 * for again. `tell` hears in words how far it is, and the share that is done.
 */
export const simulate = (form, { signal, tell }) =>
  patiently(
    async () => {
      for await (const line of lines("/v1/admin/simulations", { method: "POST", body: form, signal })) {
        if (line.result) return line.result;
        tell(`${STAGES[line.stage]} ...`, line.stage === "users" ? line.share : undefined);
      }
      throw new Away("The service went away.");
    },
    { signal, tell },
  );
