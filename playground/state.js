// The state of the page, and its address: world, seed, policy, range and who steers.

export const DEFAULT_WORLD = "paper-flock";
// The seed from 0 to 299 whose objectives at 0, 12 and 100 m and with the learned policy are nearest to the means.
export const DEFAULT_SEED = "242";

/** Returns the seed in a text without leading zeros, or null if it is not an integer in [0, 2^64). */
export function parseSeed(text) {
  if (!/^\d{1,20}$/.test(text)) return null;
  const seed = BigInt(text);
  return seed < 2n ** 64n ? String(seed) : null;
}

/** Returns the state that an address describes. Entries that are missing or invalid get their defaults. */
export function readState(hash, worlds) {
  const entries = new URLSearchParams(hash.replace(/^#/, ""));
  const find = (name) => worlds.find((world) => world.name === name);
  const world = find(entries.get("world")) ?? find(DEFAULT_WORLD);
  const range = Number(entries.get("range") || NaN);
  return {
    world,
    seed: parseSeed(entries.get("seed") ?? "") ?? DEFAULT_SEED,
    isLearned: entries.get("policy") === "learned" && world.playsPolicy,
    range: range >= 0 && range <= world.maxRange ? range : world.best,
    isSteered: entries.get("steer") === "you" && world.steered !== null,
  };
}

/** Returns the part of an address after `#`. */
export function writeState({ world, seed, isLearned, range, isSteered }) {
  const entries = new URLSearchParams({ world: world.name, seed });
  if (isLearned) entries.set("policy", "learned");
  else entries.set("range", String(range));
  if (isSteered) entries.set("steer", "you");
  return String(entries);
}

/** The range at a place of the slider, from 0 to 100: a square-root scale, rounded to readable numbers. */
export function rangeAt(place, maxRange) {
  const range = maxRange * (place / 100) ** 2;
  const unit = range < 2 ? 0.1 : range < 30 ? 0.5 : 1;
  return Number((Math.round(range / unit) * unit).toFixed(1));
}

/** The place of a range on the slider, from 0 to 100. */
export function placeOf(range, maxRange) {
  return 100 * Math.sqrt(range / maxRange);
}
