"use strict";

// The controls of a page that simulates: scenario, seed, numbers, pilot, links, code, files; those of the playground.

class Controls {
  /** `playground`: the published curve and the policies of the chapters, or null. */
  constructor(page, playground) {
    this.page = page;
    this.bindFlight();
    this.bindFiles();
    if (playground) this.bindPlayground(playground);
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
    $("next").addEventListener("click", () =>
      page.fly({ seed: String((BigInt(page.flight.seed ?? 0) + 1n) % 2n ** 64n) }),
    );
    $("steer").addEventListener("change", ({ target }) => page.fly({ isSteered: target.checked }));
    $("duel").addEventListener("click", async () => {
      const first = page.panels[0].run.spec;
      const { best, maxRange } = page.flight.scenario;
      const rivals = [page.policies.headline, `fixed:${best ?? maxRange / 10}`, `fixed:${maxRange}`];
      await page.addPolicy(rivals.find((spec) => spec && spec !== first));
      page.showAll();
    });
    $("again").addEventListener("click", () => {
      page.again();
      page.player.play();
    });
    $("copy").addEventListener("click", async () => {
      history.replaceState(null, "", `#${page.link()}`);
      const copied = await navigator.clipboard?.writeText(location.href).then(
        () => true,
        () => false,
      );
      $("announcement").textContent = copied ? "The link is copied." : "Copy the link from the address bar.";
    });
    $("python").addEventListener("toggle", () => this.showCode());
  }

  /** Takes policy files that are dropped on the page or chosen. */
  bindFiles() {
    const { page } = this;
    const take = async (file) => {
      const spec = file.name.replace(/\.npz$/, "");
      try {
        const entry = { spec, label: spec, title: `your file ${spec}`, file: file.name, group: "your files" };
        await page.policies.add(entry, new Uint8Array(await file.arrayBuffer()));
        await page.choose(page.panels[0], spec);
      } catch (error) {
        page.say(`${file.name}: ${messageOf(error)}`);
      }
    };
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      [...event.dataTransfer.files].forEach(take);
    });
    $("file").addEventListener("change", ({ target }) => [...target.files].forEach(take));
  }

  bindPlayground({ published, chapters }) {
    const { page } = this;
    this.prediction = new Prediction(page.scenarios, published, () => page.look.theme);
    for (const [id, policies] of Object.entries(chapters)) {
      $(id).addEventListener("click", async () => {
        const { flight } = readAddress("", page.scenarios, page.start);
        history.replaceState(null, "", `#${writeAddress(flight, policies)}`);
        await page.restore();
        $("panels").scrollIntoView({ block: "nearest" });
      });
    }
  }

  /** Shows the flock in the controls, in the address and in the code. */
  show() {
    const { page } = this;
    const { scenario, seed, isSteered, path } = page.flight;
    $("scenarios").value = scenario.name;
    $("seed").value = seed ?? "given start";
    $("about").textContent = scenario.title ? `${scenario.title}.` : "";
    $("steer").checked = isSteered;
    $("steering").hidden = scenario.steered === null;
    $("steer-hint").hidden = !isSteered;
    $("duel").hidden = page.panels.length > 1;
    this.showNumbers();
    const plain = writeAddress(
      page.flight,
      page.panels.map(({ run }) => run.spec),
      path,
    );
    if (location.hash !== `#${plain}`) history.replaceState(null, "", `#${plain}`);
    const isChosen = scenario.name === page.start.scenario && seed === page.start.seed;
    document.body.classList.toggle("chosen-flock", isChosen);
    this.showCode();
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
  if (code) return "Python prints the same number, to the last digit, for a run whose policy you do not change.";
  if (start) return "The flock has a given start, which no seed gives.";
  if (!scenario.isPreset) return "The scenario has no name: the page was made with it.";
  return numbers.speed === undefined ? "" : "There are no three lines for another predator's speed.";
}
