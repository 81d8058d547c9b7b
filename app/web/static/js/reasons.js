/** Why a play was chosen, in words. */

import { percent } from "./dom.js";

const EQUAL = 1e-9;

/** The reason in a sentence or three, for those who never heard of a policy. */
export async function reason({ explanation, rung }, titles) {
  if (explanation === null) return "";
  const { candidates, groups, runner_up: second } = explanation;
  if (groups === 1) return "There was nothing to choose between.";
  const [chosen] = candidates;
  const likeliest = candidates.reduce((best, one) => (one.like > best.like ? one : best));
  await titles.learn([second?.item, likeliest.item]);
  const told = [];
  if (chosen.like >= likeliest.like - EQUAL) {
    told.push(`Of ${groups} kinds of candidates it is the one that you most likely like now.`);
  } else {
    told.push(
      `Looking no further than now, ${named(likeliest, titles)} would be better (${percent(likeliest.like)}).` +
        ` Planning ahead lets it rest, and gives up ${percent(likeliest.like - chosen.like, 1)} of a like for more later.`,
    );
  }
  if (second) {
    told.push(`Next best was ${named(second, titles)}: it scored ${score(second)}, this one ${score(chosen)}.`);
  }
  if (rung) told.push("The policy was too slow or failed, so that a simpler one decided.");
  return told.join(" ");
}

const score = (group) => group.score.toPrecision(4);

function named({ item, count, model, rested }, titles) {
  if (item) return `“${titles.of(item)}”`;
  return `one of ${count} ${rested === null ? "unplayed " : ""}items of “${model}”`;
}
