// The page: the panel, the picture, and what happens between them.
const MORE_AFTER = 60, FEW_FRAMES = 70;
const MOST_CELLS = 72, LEAST_CELLS = 28, SLOW_SLICE = 50;

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
    this.borders = [];
    this.paths = [];
    this.addButtons();
  }

  /** Answer what the address asks for. */
  begin(engine) {
    const { session } = this;
    session.engine = engine;
    this.gizmo.isStill = !!engine.isStill;
    this.hasSlice &&= !!engine.reachTest;
    $("#pace").hidden = !engine.drives;
    document.documentElement.classList.toggle("still", !!engine.isStill);
    $("#slice").hidden = !this.hasSlice;
    session.onChange = () => this.show();
    session.onAsk = () => this.showAsked();
    session.open(location.hash);
    session.remember();
  }

  /** Draw, where the browser can. */
  draw(element) {
    this.view = new Canvas(element);
    this.gestures = new Gestures(element, this);
    new ResizeObserver(() => this.redraw()).observe(element);
    this.keepInView();
    this.redraw();
  }

  show() {
    const { session } = this;
    this.scene.show(session.answer);
    this.showAsked();
    if (!session.isReported) this.live?.report();
    this.settle();
  }

  /** Show what is asked for, and the answer as it is. */
  showAsked() {
    const { session, gizmo } = this;
    gizmo.show(session.target, session.answer.pose);
    this.panel.show();
    if (this.view && !this.gestures.held) this.keepInView();
    this.redraw();
  }

  /** Step back where what is asked for has left the picture, unless one looks elsewhere. */
  keepInView() {
    const { session, gizmo, scene } = this;
    const { camera } = scene;
    const points = () => [...scene.platformAt(session.target), ...gizmo.letters.map(([, place]) => place)];
    this.resize();
    if (!this.seen || camera.sees(this.seen)) camera.keepInView(points);
    this.seen = points();
  }

  lookFrom(angles) {
    this.scene.camera.lookFrom(angles);
    this.seen = null;
    if (this.view) this.keepInView();
    this.redraw();
  }

  /** Keep the end of a drag. */
  settle() {
    this.later ??= setTimeout(() => this.showMore(), this.delay);
  }

  /** What may lag behind a drag: travel, modes, the slice, and the link; the longer it takes, the less often. */
  showMore() {
    const { session, panel } = this;
    const { engine, answer } = session;
    const began = performance.now();
    if (answer.actuators && engine.solve) {
      this.showSlice();
      const from = engine.steady(answer);
      panel.showTravel(engine.travel(from));
      panel.showSingular(singularityOf(engine, from), (this.atHome ??= singularityOf(engine, engine.home) ?? {}));
      const marksOf = (each) => this.scene.marksOf(each);
      panel.showModes(engine.modes(from, marksOf), marksOf(answer));
    }
    if (answer.actuators) this.live?.more();
    this.later = null;
    this.delay = Math.max(MORE_AFTER, 3 * (performance.now() - began));
    if (this.gestures?.held || this.player?.clock || session.driver?.clock || engine.newest?.isBusy) return;
    session.remember();
    this.showSteps();
    this.keepLink();
    if (engine.solve) this.showSpeed();
  }

  /** The ways along and about the axes of the task, both ways. */
  waysFrom({ pose }) {
    const { task } = this.machine;
    return this.session.engine.axes.flatMap(([kind, axis]) =>
      [-1, 1].map((sign) => {
        const axisVector = axisOf(task, kind, axis, pose);
        return { kind, axis, sign, axisVector, vector: scaled(axisVector, sign) };
      }),
    );
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
    const width = 0.16 * this.scene.radius * length;
    for (const mesh of Object.values(this.slice ?? {})) this.view.forget(mesh);
    this.slice = areaOf(this.session.engine.reachTest(this.session.answer, [u, v]), sides, this.cells, width);
    this.sliceTook = performance.now() - began;
    if (this.sliceTook > 2 * SLOW_SLICE) this.cells = Math.max(LEAST_CELLS, this.cells >> 1);
    const at = scaled(AXES[w], pose[4 * w + 3] / length);
    this.sliceModel = framed(...[u, v].map((k) => scaled(AXES[k], 1 / length)), AXES[w], at);
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
    const { link } = this.session;
    if (location.hash === link) return;
    try {
      history.replaceState(null, "", link || location.pathname + location.search);
    } catch {
      location.hash = link;
    }
  }

  copyLink(button) {
    this.keepLink();
    return this.copy(button, location.href);
  }

  async copy(button, value) {
    const words = button.textContent;
    try {
      await navigator.clipboard.writeText(value);
    } catch {
      const text = made("textarea", { value });
      document.body.append(text);
      text.select();
      document.execCommand("copy");
      text.remove();
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = words), 1500);
  }

  /** A switch of something that is shown, or not. */
  addSwitch(id, change) {
    $(id).onclick = ({ currentTarget }) => {
      const isOn = currentTarget.getAttribute("aria-pressed") === "false";
      currentTarget.setAttribute("aria-pressed", isOn);
      change(isOn);
      this.redraw();
    };
  }

  addButtons() {
    const { session } = this;
    $("#link").onclick = ({ currentTarget }) => this.copyLink(currentTarget);
    $("#home").onclick = () => session.goHome();
    $("#undo").onclick = () => session.undo();
    $("#redo").onclick = () => session.redo();
    const { drawing } = this.machine;
    this.addSwitch("#slice", (isOn) => {
      this.hidesSlice = !isOn;
      this.showSlice();
    });
    const driver = new Driver(session), [pace, speed] = [$("#pace input"), $("#pace output")];
    const showPace = () => {
      driver.slower(Number(pace.value));
      $("#pace").style.setProperty("--share", `${100 * pace.value}%`);
      speed.textContent = this.panel.wording.speed(driver.speeds, this.machine.actuators) ?? `${rounded(100 * driver.share, 0)} %`;
    };
    pace.oninput = showPace;
    showPace();
    this.addSwitch("#pace button", (isOn) => {
      session.driver = isOn ? driver : null;
      if (!isOn) driver.stop();
    });
    this.addSwitch("#solids", (isOn) => (this.scene.hidesSolids = !isOn));
    $("#solids").hidden = !drawing.parts.some((part) => part.shape !== undefined);
    $("#show").hidden = $("#show-tab").hidden = $("#solids").hidden && !this.hasSlice;
    const isNarrow = matchMedia("(max-width: 760px)");
    const place = () => $(isNarrow.matches ? "#scroll" : "header").append($("#show"));
    isNarrow.addEventListener("change", place);
    place();
    for (const [name, angles] of Object.entries(this.machine.views)) {
      const onclick = () => this.lookFrom(angles);
      $("#views").append(made("button", { textContent: name, title: `Look from: ${name}`, onclick }));
    }
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
    const { solids, clear } = scene.solids(paints, session.held, this.distance);
    if (isGhost) clear.push(...scene.ghost(session.target, paints.held));
    if (this.sliceModel && !this.hidesSlice) {
      const paint = (clarity) => [...paints.platform.slice(0, 3), clarity];
      const [area, border] = ["area", "border"].map((name) => ({ mesh: this.slice[name], model: this.sliceModel, kind: FLAT }));
      clear.unshift({ ...area, paint: paint(this.isDark ? 0.2 : 0.15) }, { ...border, paint: paint(0.6) });
    }
    for (const { mesh, paint } of this.borders) clear.push({ mesh, model: IDENTITY, paint, gloss: 0 });
    for (const { mesh, paint } of this.paths) solids.push({ mesh, model: IDENTITY, paint: paints[paint], kind: FLAT });
    if (this.distance && !scene.hidesSolids) {
      const { ends, isHeld } = this.distance;
      const paint = isHeld ? paints.held : paints.steel;
      if (norm(minus(...ends)) > 1e-6) clear.push({ mesh: TUBE, model: tubeFrom(...ends, 0.5 * scene.radius), paint, kind: FLAT });
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
    if (this.distance && !scene.hidesSolids) {
      const [x, y] = scene.camera.onScreen(middle(this.distance.ends));
      const { wording } = this.panel;
      tags.push([`${wording.length(this.distance.distance)} ${wording.unit}`, x + 12, y - 10, "distance"]);
    }
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

/** What answers: kernels in the page, the program that serves it, or nothing but what was written into it. */
function engineFor(machine) {
  if (machine.image) return Engine.open(KERNELS, machine);
  return machine.live ? new RemoteEngine(machine) : new StillEngine(machine);
}

async function start() {
  const began = performance.now();
  const machine = JSON.parse($("#machine").textContent);
  const opening = engineFor(machine);
  const page = new Page(machine);
  window.page = page;
  page.begin(await opening);
  if (machine.live) page.live = new Live(page);
  if (machine.track) page.player = await Player.open(page, machine.track);
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
