"use strict";

// The state of the page in its address: #scenario=..&seed=..&policies=..&agents=..&steer=you&guess=..

/** Returns the seed in a text without leading zeros, or null if it is not an integer in [0, 2^64). */
function parseSeed(text) {
  if (!/^\d{1,20}$/.test(text)) return null;
  const seed = BigInt(text);
  return seed < 2n ** 64n ? String(seed) : null;
}

/**
 * Returns the flock, the policies and the time that an address describes. What is missing or invalid is as in `start`;
 * `problems` are sentences about what is invalid.
 */
function readAddress(hash, scenarios, start) {
  const entries = new URLSearchParams(hash.replace(/^#/, ""));
  const problems = [];
  /** Reads an entry; `parse` returns null for an invalid text. */
  const read = (name, expected, parse, fallback) => {
    const text = entries.get(name);
    const value = text === null ? fallback : parse(text);
    if (text !== null && value === null) problems.push(`${name}: expected ${expected}, got ${text}.`);
    return value ?? fallback;
  };
  const find = (name) => scenarios.find((scenario) => scenario.name === name) ?? null;
  const scenario = read("scenario", "a scenario of this page", find, find(start.scenario));
  const isSteered = read("steer", "you", (text) => text === "you" || null, false) && scenario.steered !== null;
  const numberIn = (least, most) => (text) => (text !== "" && text >= least && text <= most ? Number(text) : null);
  const { least, most } = AGENTS;
  const agents = read("agents", `a number from ${least} to ${most}`, numberIn(least, most), null);
  const largest = scenario.ranges.at(-1);
  const guess = read("guess", `a range from 0 to ${largest}`, numberIn(0, largest), null);
  const first = scenario.start ? null : (start.seed ?? "0");
  const seed = read("seed", "an integer from 0 to 2^64 - 1", parseSeed, first);
  const time = read("t", "a time in s", numberIn(0, Infinity), null);
  const listed = entries.get("policies")?.split(",").filter(Boolean) ?? [];
  const known = ["scenario", "seed", "policies", "t", "steer", "agents", "guess"];
  for (const name of entries.keys()) if (name && !known.includes(name)) problems.push(`${name}: unknown entry.`);
  const asked = listed.map((spec) => spec.replaceAll("%2C", ",")); // a file's name can have commas
  if (asked.length > MAX_PANELS) problems.push(`policies: expected at most ${MAX_PANELS}, got ${asked.length}.`);
  const ofScenario = scenario.name === start.scenario ? start.policies : [`fixed:${scenario.first}`];
  const policies = (asked.length ? asked : ofScenario).slice(0, MAX_PANELS);
  return { flight: { scenario, seed, agents, isSteered }, policies, time, guess, problems };
}

/** Returns the part of an address after `#`. */
function writeAddress({ scenario, seed, agents, isSteered }, policies, guess = null) {
  const entries = [["scenario", scenario.name]];
  if (seed !== null) entries.push(["seed", seed]);
  const listed = policies.map((spec) => spec.replaceAll(",", "%2C")).join(",");
  entries.push(["policies", listed]);
  if (agents !== null) entries.push(["agents", agents]);
  if (isSteered) entries.push(["steer", "you"]);
  if (guess !== null) entries.push(["guess", guess]);
  const plain = (text) => encodeURIComponent(text).replace(/%(2F|3A|2C)/g, (code) => decodeURIComponent(code));
  return entries.map(([name, value]) => `${name}=${plain(String(value))}`).join("&");
}

/** Shows the part of the address after `#`, and returns the whole address. */
function showAddress(fragment) {
  const address = `${location.href.split("#")[0]}#${fragment}`; // a part alone belongs to the parent of <iframe srcdoc>
  try {
    if (location.href !== address) history.replaceState(null, "", address);
  } catch {
    // A sandbox forbids it, or Safari, which counts calls. The page works without.
  }
  return address;
}
