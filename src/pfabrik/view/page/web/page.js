// The page: the panel, the picture, and what happens between them.
const MORE_AFTER = 60, FEW_FRAMES = 70;
const MOST_CELLS = 112, LEAST_CELLS = 40, SLOW_SLICE = 50;

class Page {
  constructor(machine) {
    this.machine = machine;
    this.scene = new Scene(machine);
    this.gizmo = new Gizmo(machine, this.scene);
    this.session = new Session(machine);
    this.panel = new Panel(machine, this.session);
    this.hasSlice = machine.task.slides.length > 1;
    this.isSoft = true;
    this.isCoarse = false;
    this.frames = 0;
    this.delay = MORE_AFTER;
    this.cells = MOST_CELLS;
    this.sliceTook = 0;
    this.addButtons();
  }

  /** Answer what the address asks for. */
  begin(engine) {
    this.session.engine = engine;
    this.session.onChange = () => this.show();
    this.session.open(location.hash);
    this.session.remember();
  }

  /** Draw, where the browser can. */
  draw(element) {
    this.view = new Canvas(element);
    this.gestures = new Gestures(element, this);
    new ResizeObserver(() => this.redraw()).observe(element);
    this.redraw();
  }

  show() {
    const { session } = this;
    this.scene.show(session.answer.pose, session.answer.q);
    this.gizmo.show(session.target, session.answer.pose);
    this.panel.show();
    this.redraw();
    this.settle();
  }

  /** Keep the end of a drag. */
  settle() {
    this.later ??= setTimeout(() => this.showMore(), this.delay);
  }

  /** What may lag behind a drag: travel, modes, the slice, and the link; the longer it takes, the less often. */
  showMore() {
    const { session, panel } = this;
    const began = performance.now();
    if (session.answer.actuators) {
      this.showSlice();
      const from = session.engine.steady(session.answer);
      panel.showTravel(session.engine.travel(from));
      panel.showSingular(singularityOf(session.engine, from));
      const marksOf = (answer) => this.scene.marksOf(answer);
      panel.showModes(session.engine.modes(from, marksOf), marksOf(session.answer));
    }
    this.later = null;
    this.delay = Math.max(MORE_AFTER, 3 * (performance.now() - began));
    if (this.gestures?.held) return;
    session.remember();
    this.showSteps();
    this.keepLink();
    this.showSpeed();
  }

  showSlice() {
    if (!this.view || !this.hasSlice || this.hidesSlice) return;
    if (this.gestures?.held && this.sliceTook > SLOW_SLICE) return;
    const { home, box, length, drawing } = this.machine;
    const [u, v, w] = drawing.sliceAxes;
    const { pose, branch } = this.session.answer;
    const key = [...pose.filter((_, k) => k % 4 < 3 || k === 4 * w + 3), ...branch].map((value) => value.toPrecision(5));
    if (this.sliceKey === String(key)) return;
    this.sliceKey = String(key);
    const sides = [u, v].map((k) => {
      const centre = home[4 * k + 3];
      const reach = 1.3 * Math.max(centre - box[0][k], box[1][k] - centre, 0.4 * length);
      return [centre - reach, centre + reach];
    });
    const began = performance.now();
    this.view.setSlice(this.session.engine.slice(this.session.answer, [u, v], sides, this.cells), this.cells);
    this.sliceTook = performance.now() - began;
    if (this.sliceTook > 2 * SLOW_SLICE) this.cells = Math.max(LEAST_CELLS, this.cells >> 1);
    const axes = [u, v].map((k, i) => scaled(AXES[k], (sides[i][1] - sides[i][0]) / (2 * length)));
    const at = [0, 0, 0];
    [u, v].forEach((k, i) => (at[k] = (sides[i][0] + sides[i][1]) / (2 * length)));
    at[w] = pose[4 * w + 3] / length;
    this.sliceModel = framed(...axes, AXES[w], at);
    this.redraw();
  }

  /** How long such an answer takes here: asked again for a few milliseconds. */
  showSpeed() {
    const { engine, target, start } = this.session;
    const began = performance.now();
    let count = 0;
    do engine.ask(target, start), count++;
    while (performance.now() - began < 4);
    const us = (1000 * (performance.now() - began)) / count;
    const words = us < 1000 ? `${us.toFixed(us < 10 ? 1 : 0)} µs` : `${(us / 1000).toFixed(1)} ms`;
    $("#speed").textContent = `${words} an answer on this device · pfabrik`;
  }

  keepLink() {
    if (location.hash === this.session.link) return;
    try {
      history.replaceState(null, "", this.session.link);
    } catch {
      location.hash = this.session.link;
    }
  }

  async copyLink(button) {
    this.keepLink();
    const words = button.textContent;
    try {
      await navigator.clipboard.writeText(location.href);
    } catch {
      const text = made("textarea", { value: location.href });
      document.body.append(text);
      text.select();
      document.execCommand("copy");
      text.remove();
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = words), 1500);
  }

  addButtons() {
    const { session } = this;
    $("#link").onclick = ({ currentTarget }) => this.copyLink(currentTarget);
    $("#home").onclick = () => session.goHome();
    $("#undo").onclick = () => session.undo();
    $("#redo").onclick = () => session.redo();
    $("#slice").hidden = !this.hasSlice;
    $("#slice").onclick = ({ currentTarget }) => {
      this.hidesSlice = !this.hidesSlice;
      currentTarget.setAttribute("aria-pressed", !this.hidesSlice);
      this.showSlice();
      this.redraw();
    };
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.light(dark.matches));
    $("#theme").onclick = () => this.light(!this.isDark);
    this.light(dark.matches);
    // A page around this one has its name, and may say which theme it has.
    document.documentElement.classList.toggle("within", self !== top);
    addEventListener("message", ({ data }) => data?.theme && this.light(data.theme === "dark"));
    addEventListener("hashchange", () => location.hash !== session.link && session.open(location.hash));
    addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || !"zy".includes(event.key.toLowerCase())) return;
      event.preventDefault();
      if (event.shiftKey || event.key.toLowerCase() === "y") session.redo();
      else session.undo();
    });
  }

  showSteps() {
    $("#undo").disabled = !this.session.past.length;
    $("#redo").disabled = !this.session.future.length;
  }

  light(isDark) {
    this.isDark = isDark;
    document.documentElement.dataset.theme = isDark ? "dark" : "light";
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => [1, 3, 5].map((k) => parseInt(style.getPropertyValue(name).trim().slice(k, k + 2), 16) / 255);
    this.paints = Object.fromEntries(
      ["link", "steel", "base", "platform", "drive", "held", "ink", "bright"].map((name) => [name, [...colour(`--${name}`), 1]]),
    );
    for (const name of ["ink", "bright"]) this.paints[name].pop();
    this.paints.axes = ["--x", "--y", "--z"].map(colour);
    if (this.view) this.redraw();
  }

  redraw() {
    if (this.asked || !this.view) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      const began = performance.now();
      this.resize();
      this.view.render(this.picture());
      this.showNames();
      this.adapt(began);
      this.frameTook = performance.now() - began;
      this.frames++;
      this.shown ??= performance.now();
    });
  }

  resize() {
    const { element } = this.view;
    const scale = Math.min(devicePixelRatio || 1, this.isSoft ? 2 : 1) * (this.isCoarse ? 0.6 : 1);
    const [width, height] = [element.clientWidth, element.clientHeight];
    const [w, h] = [width, height].map((size) => Math.max(1, Math.round(size * scale)));
    if (element.width !== w || element.height !== h) Object.assign(element, { width: w, height: h });
    const isBeside = innerWidth > 760 && width > 700;
    this.scene.camera.resize(width, height, isBeside ? 356 / width : 0);
    this.scene.camera.look();
  }

  picture() {
    const { scene, gizmo, session, paints } = this;
    const { camera } = scene;
    const isGhost = session.answer.status === PROJECTED && !session.wished;
    const { solids, clear } = scene.solids(paints, session.held);
    if (isGhost) clear.push(...scene.ghost(session.target, paints.held));
    if (this.sliceModel && !this.hidesSlice) {
      const paint = [...paints.platform.slice(0, 3), this.isDark ? 0.2 : 0.15];
      clear.unshift({ mesh: SQUARE, model: this.sliceModel, paint, kind: SLICE });
    }
    const side = 2.4 * scene.size;
    const floor = [scene.drawing.centre[0], scene.drawing.centre[1], camera.floor];
    const ground = framed([side, 0, 0], [0, side, 0], AXES[2], floor);
    return {
      solids,
      clear,
      ground: { mesh: SQUARE, model: ground, paint: [...paints.ink, this.isDark ? 0.13 : 0.1], kind: GROUND },
      handles: gizmo.handles(paints),
      handle: gizmo.centre,
      camera,
      centre: scene.drawing.centre,
      radius: scene.size,
      light: this.isDark
        ? { sky: [0.66, 0.7, 0.78], soil: [0.36, 0.36, 0.4], shade: 0.5 }
        : { sky: [0.7, 0.71, 0.73], soil: [0.42, 0.41, 0.4], shade: 0.2 },
      isSoft: this.isSoft,
    };
  }

  /** Without a graphics chip soft shadows go first, then resolution. */
  adapt(began) {
    const passed = began - (this.last ?? 0);
    this.last = began;
    this.slow = this.gestures?.held && passed > FEW_FRAMES && passed < 2000 ? (this.slow ?? 0) + 1 : 0;
    if (this.slow <= 3) return;
    this.slow = 0;
    this.isCoarse = !this.isSoft;
    this.isSoft = false;
  }

  /** The names of limits at their joints, and the letters of the axes. */
  showNames() {
    const { scene, session, gizmo } = this;
    const limits = session.isFar ? session.answer.limits.slice(0, 8) : [];
    const used = [];
    const tags = limits.map(({ joint, bound }) => {
      let [x, y] = scene.camera.onScreen(scene.points[scene.names.get(joint)] ?? gizmo.centre);
      while (used.some(([a, b]) => Math.abs(a - x) < 80 && Math.abs(b - y) < 20)) y += 21;
      used.push([x, y]);
      return [`${joint} ${bound}`, x + 12, y - 10, "held"];
    });
    const letters = gizmo.letters.map(([text, place, axis]) => {
      const [x, y] = scene.camera.onScreen(place);
      return [text, x - 4, y - 10, "xyz"[axis]];
    });
    const box = $("#names");
    const wanted = [...tags, ...letters];
    while (box.children.length < wanted.length) box.append(made("span"));
    while (box.children.length > wanted.length) box.lastChild.remove();
    wanted.forEach(([text, x, y, name], k) => {
      const each = box.children[k];
      each.textContent = text;
      each.className = name;
      each.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    });
  }
}

async function start() {
  const began = performance.now();
  const machine = JSON.parse($("#machine").textContent);
  const opening = Engine.open(KERNELS, machine);
  const page = new Page(machine);
  page.begin(await opening);
  window.page = page;
  page.times = [began, performance.now()];
  try {
    page.draw($("canvas"));
  } catch (error) {
    console.warn(error);
    $("header p").textContent = "This browser has no WebGL 2, so there is no picture. Everything in the panel works.";
  }
}
start().catch((error) => {
  $("#status b").textContent = "This browser cannot show it";
  $("#status p").textContent = String(error.message ?? error).slice(0, 300);
  throw error;
});
