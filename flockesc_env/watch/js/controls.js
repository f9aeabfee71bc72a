"use strict";

// The controls of a page that simulates: scenario, seed, numbers, pilot, links, code, files.

const ORDINALS = ["First", "Second", "Third", "Fourth"];

class Controls {
  constructor(page) {
    this.page = page;
    this.bindFlight();
    this.bindFiles();
  }

  bindFlight() {
    const { page } = this;
    document.body.classList.add("live");
    const names = page.scenarios.map(({ name, label }) => new Option(label ?? name.replaceAll("-", " "), name));
    $("scenarios").append(...names);
    $("scenarios").addEventListener("change", ({ target }) => {
      page.fly({ scenario: page.scenarios.find(({ name }) => name === target.value) });
    });
    $("seed").addEventListener("change", ({ target }) => {
      const seed = parseSeed(target.value.trim());
      if (seed === null) page.say(`seed: expected an integer from 0 to 2^64 - 1, got ${target.value}`);
      else page.fly({ seed });
      this.show();
    });
    $("next").addEventListener("click", () => page.next());
    $("steer").addEventListener("click", () => page.steer(!page.flight.isSteered));
    $("duel").addEventListener("click", async () => {
      const shown = page.panels.map(({ run }) => run.spec);
      const { best, maxRange } = page.flight.scenario;
      const rivals = [`fixed:${best ?? maxRange / 10}`, page.policies.headline, `fixed:${maxRange}`, "fixed:0"];
      page.isTouring = false;
      await page.addPolicy(rivals.find((spec) => spec && !shown.includes(spec)) ?? shown[0]);
      page.showAll();
    });
    $("again").addEventListener("click", () => {
      page.again();
      page.player.play();
    });
    for (const id of ["copy", "challenge"]) $(id).addEventListener("click", () => this.copy());
    $("python").addEventListener("toggle", () => this.showCode());
  }

  async copy() {
    const { page } = this;
    const address = showAddress(page.link());
    const copied = await navigator.clipboard?.writeText(address).then(
      () => true,
      () => false,
    );
    const files = page.panels.map(({ run }) => run.policy?.isDropped && run.policy.file).filter(Boolean);
    const note = files.length ? ` It does not hold ${files.join(", ")}: send the file, too.` : "";
    const hint = location.protocol === "about:" ? "This frame has no address." : "Copy the link from the address bar.";
    page.say((copied ? "The link is copied." : hint) + note);
  }

  /** Takes policy files that are dropped on the page or chosen. */
  bindFiles() {
    const { page } = this;
    const take = async (file) => {
      const { name } = file; // with its suffix, which no built-in policy has
      const entry = { spec: name, label: name, title: `your file ${name}`, file: name, group: "your files" };
      try {
        if (!/\.npz$/i.test(name)) throw new Error("expected a policy file (.npz)");
        await page.policies.add({ ...entry, isDropped: true }, new Uint8Array(await file.arrayBuffer()));
        await page.choose(page.active, name);
      } catch (error) {
        page.say(`${name}: ${messageOf(error)}`);
      }
    };
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      [...event.dataTransfer.files].forEach(take);
    });
    $("file").addEventListener("change", ({ target }) => [...target.files].forEach(take));
  }

  /** Shows the flock in the controls, in the address and in the code. */
  show() {
    const { page } = this;
    const { scenario, seed, isSteered, path } = page.flight;
    $("scenarios").value = scenario.name;
    $("seed").value = seed ?? "given start";
    $("about").textContent = scenario.title ? `${scenario.title}.` : "";
    $("steer").hidden = scenario.steered === null || !page.steering.first;
    $("steer").textContent = isSteered ? "Give the predator back" : "You be the predator";
    $("duel").hidden = page.panels.length >= MAX_PANELS;
    for (const panel of page.panels) page.policies.list(panel.select, panel.run, page.recordings);
    page.prediction?.show(page.flight);
    this.showNumbers();
    this.showResults();
    this.showCode();
    if (page.isTouring || document.body.classList.contains("asking")) return; // opening the page again begins again
    const specs = page.panels.map(({ run }) => run.spec);
    showAddress(writeAddress(page.flight, specs, path));
  }

  /** Shows what whole runs have given. */
  showResults() {
    const { flight, steering } = this.page;
    $("aim").textContent = flight.isSteered && steering.first ? steering.describe() : "";
    $("challenge").hidden = ![...steering.tries.values()].some(({ now }) => now !== null);
    this.showChoice();
  }

  /** Shows the slider of the active panel. */
  showChoice() {
    const { page } = this;
    const { active, panels, flight, trials, look } = page;
    if (!active) return;
    const name = panels.length < 2 ? "All agents" : `${ORDINALS[panels.indexOf(active)]} flock: agents`;
    $("choice").style.setProperty("--run", look.theme.runs[active.run.color % look.theme.runs.length]);
    page.choice.show(active, flight, name, trials, look.theme);
  }

  /** Shows the numbers of the scenario that a reader can change. */
  showNumbers() {
    const { page } = this;
    const { numbers, document: scenario } = page.flight;
    $("numbers").replaceChildren(
      ...page.flight.editable.map((name) => {
        const { label, least, most, step, read } = NUMBERS[name];
        const input = element("input", {
          type: "number",
          min: least,
          max: most,
          step,
          value: numbers[name] ?? read(scenario),
        });
        input.addEventListener("change", () => {
          const value = Number(input.value);
          if (value >= least && value <= most) page.fly({ numbers: { ...page.flight.numbers, [name]: value } });
          else page.say(`${label}: expected a number from ${least} to ${most}, got ${input.value}`);
        });
        return element("label", {}, `${label} `, input);
      }),
    );
  }

  /** Shows the code of the first panel at once, and what it prints when the controls rest. */
  showCode() {
    const { page } = this;
    clearTimeout(this.codeTimer);
    if (!$("python").open) return;
    const { run } = page.panels.find((panel) => panel.run.isLive) ?? {};
    const code = run ? pythonCode(page.flight, run.policy, null) : null;
    $("code").textContent = code ?? "";
    const { file, sha256 } = run?.policy ?? {};
    $("code-note").textContent = codeNote(page.flight, code) + (sha256 ? ` sha256 of ${file}: ${sha256}` : "");
    if (!code) return;
    this.codeTimer = setTimeout(() => {
      const { flight } = page;
      const played = flight.isSteered ? new Flight({ ...flight, isSteered: false }) : flight;
      $("code").textContent = pythonCode(flight, run.policy, objectiveOf(played, run.policy));
    }, 300);
  }
}

function codeNote({ isSteered, scenario, start, numbers }, code) {
  if (isSteered) return "The code plays this flock with the predator of the scenario: nobody steers it.";
  if (code) return "Python prints the same number, to the last digit.";
  if (start) return "The flock has a given start, which no seed gives.";
  if (!scenario.isPreset) return "The scenario has no name: the page was made with it.";
  return numbers.speed === undefined ? "" : "There are no three lines for another predator's speed.";
}
