"use strict";

// The controls of live pages: world, seed, numbers, pilot, links, code, files; and those of the playground.

Object.assign(Page.prototype, {
  bindWorld() {
    document.body.classList.add("live");
    const names = this.worlds.map(({ name, label }) => new Option(label ?? name.replaceAll("-", " "), name));
    $("worlds").append(...names);
    $("worlds").addEventListener("change", ({ target }) => {
      this.fly({ world: this.worlds.find(({ name }) => name === target.value) });
    });
    $("seed").addEventListener("change", ({ target }) => {
      const seed = parseSeed(target.value.trim());
      if (seed === null) this.say(`seed: expected an integer from 0 to 2^64 - 1, got ${target.value}`);
      else this.fly({ seed });
      this.showWorld();
    });
    $("next").addEventListener("click", () => this.fly({ seed: String((BigInt(this.flight.seed ?? 0) + 1n) % 2n ** 64n) }));
    $("steer").addEventListener("change", ({ target }) => this.fly({ isSteered: target.checked }));
    $("duel").addEventListener("click", async () => {
      const first = this.panels[0].run.spec;
      const { best, maxRange } = this.flight.world;
      const rivals = [this.policies.headline, `fixed:${best ?? maxRange / 10}`, `fixed:${maxRange}`];
      await this.addPanel(rivals.find((spec) => spec && spec !== first));
      this.showAll();
    });
    $("again").addEventListener("click", () => {
      this.again();
      this.player.play();
    });
    $("copy").addEventListener("click", async () => {
      history.replaceState(null, "", `#${this.link()}`);
      const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
      $("announcement").textContent = copied ? "The link is copied." : "Copy the link from the address bar.";
    });
    $("python").addEventListener("toggle", () => this.showCode());
    const take = async (file) => {
      const spec = file.name.replace(/\.npz$/, "");
      try {
        const entry = { spec, label: spec, title: `your file ${spec}`, file: file.name, group: "your files" };
        await this.policies.add(entry, new Uint8Array(await file.arrayBuffer()));
        await this.choose(this.panels[0], spec);
      } catch (error) {
        this.say(`${file.name}: ${messageOf(error)}`);
      }
    };
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      [...event.dataTransfer.files].forEach(take);
    });
    $("file").addEventListener("change", ({ target }) => [...target.files].forEach(take));
  },

  /** The address of the present state, with the pointer's path. */
  link() {
    const first = this.panels.find(({ run }) => run.isLive)?.run;
    const path = this.flight.isSteered ? (first?.targets ?? []) : [];
    return writeAddress(this.flight, this.panels.map(({ run }) => run.spec), path);
  },

  /** Shows the flock in the controls, in the address and in the code. */
  showWorld() {
    const { world, seed, isSteered, numbers, document: scenario } = this.flight;
    $("worlds").value = world.name;
    $("seed").value = seed ?? "given start";
    $("about").textContent = world.title ? `${world.title}.` : "";
    $("steer").checked = isSteered;
    $("steering").hidden = world.steered === null;
    $("steer-hint").hidden = !isSteered;
    $("duel").hidden = this.panels.length > 1;
    $("numbers").replaceChildren(
      ...this.flight.editable.map((name) => {
        const { label, least, most, step, read } = NUMBERS[name];
        const input = element("input", { type: "number", min: least, max: most, step, value: numbers[name] ?? read(scenario) });
        input.addEventListener("change", () => {
          const value = Number(input.value);
          if (value >= least && value <= most) this.fly({ numbers: { ...this.flight.numbers, [name]: value } });
          else this.say(`${label}: expected a number from ${least} to ${most}, got ${input.value}`);
        });
        return element("label", {}, `${label} `, input);
      }),
    );
    const plain = writeAddress(this.flight, this.panels.map(({ run }) => run.spec), this.flight.path);
    if (location.hash !== `#${plain}`) history.replaceState(null, "", `#${plain}`);
    this.showChosen?.();
    this.showCode();
  },

  /** Shows the code of the first panel at once, and what it prints when the controls rest. */
  showCode() {
    clearTimeout(this.codeTimer);
    if (!$("python").open) return;
    const { run } = this.panels.find((panel) => panel.run.isLive) ?? {};
    const code = run ? pythonCode(this.flight, run.policy, null) : null;
    $("code").textContent = code ?? "";
    $("code-note").textContent = codeNote(this.flight, code);
    if (!code) return;
    this.codeTimer = setTimeout(() => {
      const { flight } = this;
      const played = flight.isSteered ? new Flight({ ...flight, isSteered: false }) : flight;
      $("code").textContent = pythonCode(flight, run.policy, objectiveOf(played, run.policy));
    }, 300);
  },

  bindPlayground({ published, chapters }) {
    if (!this.isLive) return;
    this.prediction = new Prediction(this.worlds, published, () => this.look.theme);
    for (const [id, policies] of Object.entries(chapters)) {
      $(id).addEventListener("click", async () => {
        history.replaceState(null, "", `#${writeAddress({ ...readAddress("", this.worlds, this.start).flight, numbers: {} }, policies)}`);
        await this.restore();
        $("panels").scrollIntoView({ block: "nearest" });
      });
    }
    this.showChosen = () => {
      const { world, seed } = this.flight;
      const isChosen = world.name === this.start.world && seed === this.start.seed;
      document.body.classList.toggle("chosen-flock", isChosen);
    };
  },
});

function codeNote({ isSteered, world, start, numbers }, code) {
  if (isSteered) return "The code plays this flock with the predator of the world: nobody steers it.";
  if (code) return "Python prints the same number, to the last digit, for a run whose policy you do not change.";
  if (start) return "The flock has a given start, which no seed gives.";
  if (!world.isPreset) return "The scenario has no name: the page was made with it.";
  return numbers.speed === undefined ? "" : "There are no three lines for another predator's speed.";
}
