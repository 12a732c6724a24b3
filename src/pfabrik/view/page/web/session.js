// What is asked for, the answer to it, the steps that can be undone, and the link that keeps them.
const REACHED = 0, PROJECTED = 1, EXCEEDED = 2, FAILED = 3, INVALID = 4;
const MOST_STEPS = 200, SINGULAR = 1e-4;

class Session {
  constructor(machine, engine = null) {
    Object.assign(this, { machine, engine, past: [], future: [], answer: null, target: null, hasJumped: false });
  }

  /** Ask for a pose: from the answer before, in its working mode; afresh where that has no configuration. */
  ask(target, { isFresh = false } = {}) {
    const start = !isFresh && this.answer?.actuators ? this.answer : null;
    this.start = start;
    let answer = this.timed(() => this.engine.ask(target, start));
    const isKept = start !== null && answer.actuators !== null;
    if (start && !isKept) answer = this.engine.ask(target, null);
    const hasJumped = isKept && this.target !== null && this.engine.jumps(start, this.target, target, answer);
    this.settle({ target: [...target], answer, wished: null, origin: isKept ? this.origin : null, hasJumped });
  }

  /** Ask for values of the actuators. */
  assemble(values) {
    const start = this.answer.actuators ? this.answer : null;
    const answer = this.timed(() => this.engine.assemble(values, start));
    this.settle({ target: [...answer.pose], answer, wished: [...values], hasJumped: false });
  }

  /** Take an answer that was found already, such as one in another working mode. */
  take(answer) {
    this.settle({ target: [...answer.pose], answer, wished: null, origin: null, hasJumped: false });
  }

  goHome() {
    this.ask(this.machine.home, { isFresh: true });
  }

  timed(ask) {
    const began = performance.now();
    const answer = ask();
    this.took = performance.now() - began;
    return answer;
  }

  settle(state) {
    Object.assign(this, state);
    this.onChange?.();
  }

  /** The signs of legs that have two branches. */
  get mode() {
    return this.answer.branch.filter((_, k) => this.machine.branches[k]).map((side) => (side < 0 ? "-" : "+"));
  }

  /** Note if a parallel singularity was passed since a configuration was shown, in one mode without a dead point. */
  observe(measures) {
    if (!measures) return;
    const mode = this.mode.join("");
    if (measures.serial < SINGULAR) this.origin = null;
    else if (this.origin?.mode !== mode) this.origin = { mode, side: measures.side };
    this.isAcross = measures.parallel >= SINGULAR && measures.side * (this.origin?.side ?? 0) < 0;
  }

  get isFar() {
    return this.answer.status !== REACHED;
  }

  /** Joints that an answer out of reach lights up. */
  get held() {
    return new Set(this.isFar ? this.answer.limits.map((limit) => limit.joint) : []);
  }

  /** Keep the present state as a step that can be undone. */
  remember() {
    const { target, answer, wished, origin } = this;
    if (this.present?.answer === answer) return;
    if (this.present) this.past = [...this.past.slice(-MOST_STEPS), this.present];
    this.present = { target, answer, wished, origin };
    this.future = [];
  }

  undo() {
    this.remember();
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  step(from, to) {
    if (!from.length) return;
    to.push(this.present);
    this.present = from.pop();
    this.settle({ ...this.present, hasJumped: false });
  }

  /** The part of an address that keeps the target and the branches of the legs. */
  get link() {
    const compact = (value) => String(Math.abs(value) < 1e-9 ? 0 : +value.toPrecision(10));
    const numbers = [...originOf(this.target), ...anglesOf(this.target)].map(compact);
    return `#p=${numbers.join(",")}${this.mode.length ? `&m=${this.mode.join("")}` : ""}`;
  }

  open(link) {
    const parts = new URLSearchParams(link.replace(/^#/, "").replace(/\+/g, "%2B"));
    const numbers = (parts.get("p") ?? "").split(",").map(Number);
    if (numbers.length !== 6 || !numbers.every(Number.isFinite)) return this.goHome();
    const signs = [...(parts.get("m") ?? "")];
    const { branches } = this.machine;
    this.answer = this.target = null;
    if (signs.length && signs.length === branches.filter(Boolean).length) {
      const branch = this.engine.home.branch.map((side, k) => (branches[k] ? signs.shift() + 1 : side));
      this.answer = { ...this.engine.home, branch: branch.map(Number) };
    }
    return this.ask(poseOf(numbers.slice(0, 3), numbers.slice(3)));
  }
}
