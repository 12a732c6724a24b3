// Pointers and keys: drag what is under them, look around, zoom, move step by step.
const KEYS = {
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, 1], PageDown: [2, -1],
};
const SLACK = 11, SLACK_OF_TOUCH = 24;

class Gestures {
  constructor(canvas, page) {
    Object.assign(this, { canvas, page, pointers: new Map(), held: null, spread: null });
    const listen = (name, handler, options) => canvas.addEventListener(name, handler.bind(this), options);
    listen("pointerdown", this.down);
    listen("pointermove", this.move);
    listen("pointerup", this.up);
    listen("pointercancel", this.up);
    listen("wheel", this.wheel, { passive: false });
    listen("keydown", this.key);
    listen("contextmenu", (event) => event.preventDefault());
    listen("dblclick", () => page.scene.camera.reset() ?? page.redraw());
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  down(event) {
    const { canvas, pointers, page } = this;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    pointers.set(event.pointerId, this.at(event));
    this.spread = null;
    this.held = null;
    if (pointers.size > 1 || event.button !== 0) return;
    const part = page.gizmo.pick(...this.at(event), event.pointerType === "touch" ? SLACK_OF_TOUCH : SLACK);
    if (part) this.held = page.gizmo.grab(part, ...this.at(event));
    page.gizmo.hot = part;
    this.mark();
  }

  move(event) {
    const { page, pointers, held } = this;
    const place = this.at(event);
    const last = pointers.get(event.pointerId);
    if (!last) return this.hover(place);
    pointers.set(event.pointerId, place);
    const [x, y] = [place[0] - last[0], place[1] - last[1]];
    if (pointers.size > 1) this.pinch();
    else if (held) return page.session.ask(page.gizmo.drag(held, ...place), { gesture: held });
    else if (event.shiftKey || event.buttons === 2) page.scene.camera.pan(x, y, this.canvas.clientHeight);
    else page.scene.camera.orbit(x, y);
    return page.redraw();
  }

  hover(place) {
    const part = this.page.gizmo.pick(...place, SLACK);
    if (part === this.page.gizmo.hot) return;
    this.page.gizmo.hot = part;
    this.mark();
  }

  pinch() {
    const [a, b] = [...this.pointers.values()];
    const now = { size: apart(a, b), at: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] };
    const { camera } = this.page.scene;
    if (this.spread) {
      camera.zoom(this.spread.size / now.size);
      camera.pan(now.at[0] - this.spread.at[0], now.at[1] - this.spread.at[1], this.canvas.clientHeight);
    }
    this.spread = now;
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    this.spread = null;
    this.held = null;
    if (event.pointerType === "touch") this.page.gizmo.hot = null;
    this.mark();
    this.page.settle();
  }

  mark() {
    this.canvas.classList.toggle("over", !!this.page.gizmo.hot);
    this.canvas.classList.toggle("drag", this.pointers.size > 0);
    this.page.redraw();
  }

  /** Zoom; within another page, which scrolls by the wheel, only after a click. */
  wheel(event) {
    if (self !== top && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.page.scene.camera.zoom(Math.exp(clamp(event.deltaY, -60, 60) * 0.003));
    this.page.redraw();
  }

  key(event) {
    const { page } = this;
    const [place, sign] = KEYS[event.key] ?? [];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (sign) this.step(place, sign, event.shiftKey);
    else if (event.key === "Home" || event.key === "Escape") page.session.goHome();
    else if ("+=-".includes(event.key)) page.scene.camera.zoom(event.key === "-" ? 1.1 : 1 / 1.1);
    else return;
    event.preventDefault();
    page.redraw();
  }

  step(place, sign, isShift) {
    const { session, gizmo, scene } = this.page;
    const { slides, turns } = session.machine.task;
    const isTurn = isShift || !slides.length;
    const axes = isTurn ? turns : slides;
    const isByOrder = (gizmo.normal && !isTurn) || axes.length === 1;
    const axis = isByOrder ? axes[Math.min(place, axes.length - 1)] : axes.find((each) => each === place);
    if (axis === undefined) return;
    const kind = isTurn ? "about" : "along";
    const amount = sign * (isTurn ? DEGREE : 0.01 * scene.length);
    session.ask(displaced(session.target, kind, gizmo.axis({ kind, axis }), amount));
  }
}
