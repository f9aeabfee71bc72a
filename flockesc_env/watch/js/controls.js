"use strict";

// The controls of a page that simulates: scenario, seed, number of agents, pilot, links, code, files.

class Controls {
  constructor(page) {
    this.page = page;
    document.body.classList.add("live");
    this.bindFlight();
    this.bindFiles();
  }

  bindFlight() {
    const { page } = this;
    const names = page.scenarios.map(({ name, label }) => new Option(label ?? name.replaceAll("-", " "), name));
    $("scenarios").append(...names);
    $("scenarios").addEventListener("change", ({ target }) => {
      page.fly({ scenario: page.scenarios.find(({ name }) => name === target.value) });
    });
    $("seed").addEventListener("change", ({ target }) => {
      const seed = parseSeed(target.value.trim());
      if (seed !== null) return page.fly({ seed });
      page.say(`seed: expected an integer from 0 to 2^64 - 1, got ${target.value}`);
      this.show();
    });
    Object.assign($("agents"), { min: AGENTS.least, max: AGENTS.most });
    $("agents").addEventListener("change", ({ target }) => {
      if (target.checkValidity() && target.value) return page.fly({ agents: Number(target.value) });
      page.say(`agents: expected a number from ${AGENTS.least} to ${AGENTS.most}, got ${target.value}`);
    });
    $("next").addEventListener("click", () => page.next());
    $("steer").addEventListener("click", () => page.steer(!page.flight.isSteered));
    $("again").addEventListener("click", () => {
      page.again();
      page.player.play();
    });
    $("copy").addEventListener("click", () => this.copy());
  }

  async copy() {
    const { page } = this;
    const address = showAddress(page.link());
    const copying = navigator.clipboard?.writeText(address).then(() => true);
    const copied = await copying?.catch(() => false);
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
      const entry = { spec: name, title: `Your file ${name}`, file: name };
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
    const { scenario, seed, isSteered, document: model, start } = page.flight;
    const isFlying = page.panels.some(({ run }) => run.isLive); // recordings do not follow
    $("scenarios").value = scenario.name;
    $("seed").value = seed ?? "given start";
    $("agents").value = model.num_agents;
    $("agents").disabled = Boolean(start);
    $("about").textContent = scenario.title ? `${scenario.title}.` : "";
    $("next").hidden = !isFlying;
    $("steer").hidden = scenario.steered === null || !isFlying;
    $("steer").textContent = isSteered ? "Give the predator back" : "You be the predator";
    for (const panel of page.panels) page.policies.list(panel.select, panel.run, page.recordings);
    page.choice.show();
    this.showCode();
    if (!page.look.asking) showAddress(page.link(null));
  }

  /** Shows the code of the first panel and, once its run has ended, what it prints. */
  showCode() {
    const { flight, runs } = this.page;
    const run = runs.find(({ isLive }) => isLive);
    const isKnown = run?.hasEnded && !flight.isSteered;
    const code = run ? pythonCode(flight, run.policy, isKnown ? run.objective : null) : null;
    const { file, sha256 } = run?.policy ?? {};
    $("code").textContent = code ?? "";
    $("code-note").textContent = codeNote(flight, code) + (sha256 ? ` sha256 of ${file}: ${sha256}` : "");
  }
}
