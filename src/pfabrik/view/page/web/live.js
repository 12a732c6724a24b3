// What a page has beside when a program serves it: events, and answers that take the whole library.
const GONE_AFTER = 2000;
const BORDERS = ["workspace", "locus"];

class Live {
  constructor(page) {
    const { machine } = page;
    Object.assign(this, { page, machine, free: machine.live.free, borders: {} });
    this.states = new Newest("state", () => {});
    this.listen();
    this.addButtons();
    if (machine.live.fault) this.say(machine.live.fault, true);
    if (location.hash || this.free) this.report();
  }

  listen() {
    const { page, machine } = this;
    const events = new EventSource("events");
    const on = (name, then) => events.addEventListener(name, ({ data }) => then(JSON.parse(data)));
    on("version", (version) => version !== machine.live.version && location.reload());
    on("fault", (fault) => this.say(fault, true));
    on("show", ({ free, ...answer }) => {
      if (free !== this.free) location.href = this.place(free);
      else page.session.take(received(answer));
    });
    events.onopen = () => {
      clearTimeout(this.missing);
      $("#gone").hidden = true;
    };
    events.onerror = () => {
      clearTimeout(this.missing);
      this.missing = setTimeout(() => ($("#gone").hidden = false), GONE_AFTER);
    };
  }

  place(free) {
    return location.pathname + (free ? "?limits=no" : "");
  }

  /** A note on progress, or on what went wrong. */
  say(words, isAlarming = false) {
    $("#note").textContent = words;
    $("#note").className = isAlarming ? "alarming" : "";
  }

  asked(more = {}) {
    const { target, wished, asked, answer, start, engine } = this.page.session;
    return { free: this.free, asked, target, values: wished, answer: answer.actuators ? answer : start ?? engine.home, ...more };
  }

  /** Tell the program what is shown. */
  report() {
    this.states.ask(() => this.asked());
  }

  /** What is nearest to an answer: limits, and links; the rest where the page does not know it, travel after a drag. */
  async more() {
    this.nearby?.abort();
    const { signal } = (this.nearby = new AbortController());
    const { page } = this, { engine, answer } = page.session, travel = [];
    const ways = engine.isRemote && !page.gestures?.held ? page.waysFrom(answer) : [];
    try {
      const asked = this.asked({ directions: ways.map(({ kind, vector }) => [kind, vector]) });
      for await (const { error, limits, others, distance, reason, singular, atHome, reach } of answersTo("more", asked, signal)) {
        if (signal.aborted) return;
        if (reason) page.panel.showReason(reason);
        if (error) this.say(error, true);
        if (limits) page.panel.showLimits(limits, others);
        if (distance !== undefined) page.distance = distance;
        if (singular) page.panel.showSingular(singular, atHome);
        if (reach) {
          const way = ways[travel.length], { distance: far } = reach;
          const pose = Number.isFinite(far) ? displaced(answer.pose, way.kind, way.axisVector, way.sign * far) : answer.pose;
          travel.push({ ...way, ...reach, pose });
        }
        if (ways.length && travel.length === ways.length) page.panel.showTravel(travel);
        page.redraw();
      }
    } catch (error) {
      if (error.name !== "AbortError") console.warn(error);
    }
  }

  addButtons() {
    const { machine } = this;
    for (const name of BORDERS) {
      const button = $(`#${name}`);
      button.hidden = false;
      button.onclick = () => {
        const isWanted = button.getAttribute("aria-pressed") === "false";
        button.setAttribute("aria-pressed", isWanted);
        this.show(name, []);
        this.findBorders();
      };
    }
    const limits = $("#limited");
    limits.hidden = !this.free && (!machine.hasLimits || !!machine.track);
    limits.setAttribute("aria-pressed", !this.free);
    limits.onclick = () => (location.href = this.place(!this.free) + location.hash);
    $("#save").href = "saved";
    $("#save").hidden = $("#search").hidden = false;
    for (const name of ["show", "modes"]) this.page.panel.hide(name, false);
    for (const kind of ["working", "assembly"]) $(`#${kind}`).onclick = () => this.findModes(kind);
    $("#working").hidden = !this.page.session.engine.isRemote;
    const link = $("#link");
    link.textContent = "Copy pose";
    link.onclick = () => this.page.copy(link, this.poseAsPython());
  }

  poseAsPython() {
    const { target } = this.page.session;
    const words = [...originOf(target), ...anglesOf(target)].map((value) => String(Math.abs(value) < 1e-9 ? 0 : +value.toPrecision(6)));
    return `pf.pose([${words.slice(0, 3).join(", ")}], rpy=[${words.slice(3).join(", ")}], degrees=True)`;
  }

  show(name, patches) {
    const { page } = this;
    for (const { mesh } of this.borders[name] ?? []) page.view?.forget(mesh);
    this.borders[name] = patches.map(({ words, colour, sides, corners }) => {
      const numbers = new Float32Array(Uint8Array.from(atob(corners), (letter) => letter.charCodeAt(0)).buffer);
      const points = Array.from({ length: numbers.length / 3 }, (_, k) => [...numbers.subarray(3 * k, 3 * k + 3)]);
      const mesh = sides === 2 ? wires(pairsOf(points), 0.5 * page.scene.radius) : trianglesOf(points);
      const paint = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16) / 255);
      return { mesh, paint: [...paint, sides === 2 ? 1 : 0.38], words, colour };
    });
    page.borders = Object.values(this.borders).flat();
    $("#legend").replaceChildren(
      ...page.borders.map(({ words, colour }) => {
        const square = made("i");
        square.style.background = colour;
        return made("div", {}, square, words);
      }),
    );
    page.redraw();
  }

  async findBorders() {
    this.search?.abort();
    const names = BORDERS.filter((name) => $(`#${name}`).getAttribute("aria-pressed") === "true");
    if (!names.length) return this.say("");
    const { signal } = (this.search = new AbortController());
    try {
      for await (const { error, note, border, patches } of answersTo("borders", this.asked({ names }), signal)) {
        if (signal.aborted) return;
        if (error) this.say(error, true);
        if (note !== undefined) this.say(note);
        if (border) this.show(border, patches);
      }
    } catch (error) {
      if (error.name !== "AbortError") this.say(String(error.message ?? error), true);
    }
  }

  /** List all modes of the pose, or of the actuator values, to choose from. */
  async findModes(kind) {
    const { session } = this.page;
    this.say(`looking for ${kind} modes …`);
    for await (const { error, modes } of answersTo("modes", this.asked({ kind, values: session.wished ?? session.answer.actuators }))) {
      this.say(error ?? `${modes.length} ${kind} mode${modes.length === 1 ? "" : "s"}`, !!error);
      const buttons = (modes ?? []).map(({ words, ...mode }, k) => {
        const title = `Mode ${k + 1}, ${words}`;
        const className = words.startsWith("beyond") ? "chip beyond" : "chip";
        return made("button", { className, textContent: k + 1, title, ariaLabel: title, onclick: () => session.take(received(mode)) });
      });
      $("#listed").replaceChildren(...buttons);
    }
  }
}

const pairsOf = (points) => Array.from({ length: points.length / 2 }, (_, k) => [points[2 * k], points[2 * k + 1]]);
