"use strict";

// The answer: what the reader's range, the best single range and learned policies give, or what the reader as the
// predator has reached against them.

/** Shows a table of one row per policy. `means`: over many flocks, or null. */
function showAnswer(page, means, { guess, friend }) {
  const { flight, steering } = page;
  const isHere = (run) => run.numPredators > 0 && run.seed === (flight.start ? null : flight.seed); // or a recording
  const runs = page.runs.filter((run) => isHere(run) && (run.isLive || !flight.isSteered));
  $("answer").hidden = !runs.length;
  const meters = (value) => (Number.isFinite(value) ? value.toFixed(1) : "");
  if (flight.isSteered) {
    const rows = runs.map((run) => {
      const { straight, now, best } = steering.triesAgainst(run.policy);
      return [run, ...[straight, now, best].map(meters)];
    });
    const note = "You are the predator: lead it nearer than the straight line comes. Lowest mean distance, in m.";
    return fillAnswer(["Against", "straight", "you", "best try"], rows, note);
  }
  const shown = new Map(
    runs.map(({ spec, title, color, isLive, lowestMean, last }) => {
      return [spec, { title, color, recorded: isLive ? null : lowestMean[last] }];
    }),
  );
  const add = (range, title, color) => {
    const spec = `fixed:${range}`;
    if (range !== null && !shown.has(spec)) shown.set(spec, { title: `${title}: ${range} m`, color });
  };
  const { best, unit } = flight.scenario;
  if (unit === "m") add(best, "Best single range", "fixed");
  if (means) {
    add(guess, "Your guess", "accent");
    add(friend, "Your friend's guess", "other-2");
    if (!shown.has(page.policies.headline))
      shown.set(page.policies.headline, { title: page.learned, color: "learned" });
  }
  const meanOf = (spec) => {
    if (spec === page.policies.headline) return means.learned;
    return means.fixed[means.ranges.findIndex((range) => spec === `fixed:${range}`)] ?? null;
  };
  const rows = [...shown]
    .map(([spec, { title, color, recorded }]) => {
      const mean = means && meanOf(spec);
      const bar = element("i", { className: "mean" });
      bar.style.width = `${mean ? mean.mean : 0}%`;
      const number = element("b", {}, meters(mean?.mean));
      const flock = meters(recorded ?? page.trials.get(spec)?.objective);
      return { value: mean?.mean ?? 0, row: [{ title, color }, flock, ...(means ? [[bar, number]] : [])] };
    })
    .sort((a, b) => a.value - b.value)
    .map(({ row }) => row);
  const heads = means ? [`${means.flocks.toLocaleString("en")} flocks`] : [];
  const ofMeans = means
    ? ` Ranges of ${means.alike[0]} to ${means.alike.at(-1)} m are alike; single flocks scatter by ${means.scatter.toFixed(0)} m.`
    : "";
  fillAnswer(["", "this flock", ...heads], rows, `Lowest mean distance to the predator, in m.${ofMeans}`);
}

/** `rows`: a title and a color, and the contents of the other cells. */
function fillAnswer(heads, rows, note) {
  const cells = rows.map(([{ title, color }, ...others]) => {
    const data = others.map((content) => element("td", {}, ...[content].flat()));
    const row = element("tr", {}, element("th", { scope: "row" }, title), ...data);
    row.style.setProperty("--run", `var(--${color})`);
    return row;
  });
  const top = heads.map((text) => element(text ? "th" : "td", text ? { scope: "col" } : {}, text));
  $("answer").replaceChildren(
    element("table", {}, element("thead", {}, element("tr", {}, ...top)), element("tbody", {}, ...cells)),
    element("p", {}, note),
  );
}
