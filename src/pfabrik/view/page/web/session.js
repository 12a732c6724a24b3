// What is asked for, the answer to it, the steps that can be undone, and the link that keeps them.
const REACHED = 0, PROJECTED = 1, EXCEEDED = 2, FAILED = 3, INVALID = 4;
const MOST_STEPS = 200, SINGULAR = 1e-4, PAUSE = 1000;

class Session {
  constructor(machine, engine = null) {
    Object.assign(this, { machine, engine, past: [], future: [], answer: null, target: null, hasJumped: false });
  }

  /** Ask for a pose: from the answer before, in its working mode; afresh where that has no configuration. */
  ask(target, { isFresh = false, joints = null, gesture = null } = {}) {
    const start = !isFresh && this.answer?.actuators ? this.answer : null;
    const state = { target: [...target], wished: null, joints, asked: "pose", gesture };
    if (this.engine.isStill) return;
    this.begin(gesture);
    this.start = start;
    if (this.engine.isRemote) return this.askFar(state);
    if (this.driver && !isFresh) return this.driver.follow(state);
    let answer = this.timed(() => this.engine.ask(target, start));
    const isKept = start !== null && answer.actuators !== null;
    if (start && !isKept) answer = this.engine.ask(target, null);
    const hasJumped = isKept && this.target !== null && this.engine.jumps(start, this.target, target, answer);
    this.settle({ ...state, answer, origin: isKept ? this.origin : null, hasJumped });
  }

  /** Ask for values of the actuators. */
  assemble(values, gesture = null) {
    const state = { wished: [...values], joints: null, asked: "actuators", gesture };
    if (this.engine.isStill) return;
    this.begin(gesture);
    if (this.engine.isRemote) return this.askFar(state);
    const start = this.answer.actuators ? this.answer : null;
    const answer = this.timed(() => this.engine.assemble(values, start));
    if (this.driver && answer.actuators) return this.driver.follow({ ...state, target: [...answer.pose], wished: answer.actuators });
    this.settle({ ...state, target: [...answer.pose], answer, hasJumped: false });
  }

  /** Ask for coordinates of the passive joints in series that carry the end effector. */
  askJoints(values, gesture = null) {
    this.ask(poseOfSeries(this.machine, values), { joints: [...values], gesture });
  }

  /** Ask Python: what is asked for is shown at once, and answers follow; only the newest question is asked. */
  askFar(state) {
    Object.assign(this, state);
    this.onAsk?.();
    const make = () => ({ asked: this.asked, target: this.target, values: this.wished, answer: this.start ?? this.answer });
    this.engine.question(make, (answer, isLast) => {
      if (answer.actuators) this.start = answer;
      const target = isLast && state.asked === "actuators" ? [...answer.pose] : this.target;
      this.settle({ answer, target, hasJumped: answer.jumped, isReported: true });
    });
  }

  /** Take an answer that was found already, such as one in another working mode; it may be one to a target. */
  take(answer, target = answer.pose, gesture = null) {
    this.begin(gesture);
    this.engine.newest?.drop();
    this.start = answer;
    const nothing = { wished: null, joints: null, origin: null, hasJumped: false, isReported: false };
    this.settle({ target: [...target], answer, asked: "configuration", gesture, ...nothing });
  }

  goHome() {
    if (this.driver) this.ask(this.machine.home);
    else if (this.engine.home.q) this.take(this.engine.home);
    else this.ask(this.machine.home, { isFresh: true });
  }

  /** Keep what another gesture has left as a step. */
  begin(gesture) {
    if (this.present && (!gesture || gesture !== this.gesture)) this.remember();
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

  /** Keep the present state as a step that can be undone; the same slider that goes on without a pause makes one step. */
  remember() {
    const { target, answer, wished, joints, asked, origin } = this;
    if (!answer || this.present?.answer === answer) return;
    const goesOn = this.gesture && this.gesture === this.kept?.gesture && performance.now() - this.kept.at < PAUSE;
    this.kept = { gesture: this.gesture, at: performance.now() };
    if (this.present && !goesOn) this.past = [...this.past.slice(-MOST_STEPS), this.present];
    this.present = { target, answer, wished, joints, asked, origin };
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
    this.engine.newest?.drop();
    this.start = this.present.answer;
    this.settle({ ...this.present, hasJumped: false, isReported: false });
  }

  /** The part of an address that keeps the target, and the branches of the legs or all joints; of home there is none. */
  get link() {
    if (this.isHome) return "";
    const compact = (value) => String(Math.abs(value) < 1e-9 ? 0 : +value.toPrecision(10));
    const listed = (values) => values.map(compact).join(",");
    const rest = this.engine.isRemote ? `&q=${listed(this.answer.q)}` : this.mode.length ? `&m=${this.mode.join("")}` : "";
    return `#p=${listed([...originOf(this.target), ...anglesOf(this.target)])}${rest}`;
  }

  get isHome() {
    const { home } = this.engine, { machine, target, answer } = this;
    const far = target.reduce((most, value, k) => Math.max(most, Math.abs(value - machine.home[k])), 0);
    if (far > 1e-9 * Math.max(1, machine.length)) return false;
    return home.q ? answer === home : !machine.first && answer.branch.every((side, k) => side * home.branch[k] >= 0);
  }

  open(link) {
    const parts = new URLSearchParams(link.replace(/^#/, "").replace(/\+/g, "%2B"));
    const numbersOf = (name) => (parts.get(name) ?? "").split(",").map(Number);
    const numbers = numbersOf("p"), { branches, first, columns } = this.machine;
    if (numbers.length !== 6 || !numbers.every(Number.isFinite)) return first ? this.take(received(first)) : this.goHome();
    const pose = poseOf(numbers.slice(0, 3), numbers.slice(3));
    if (this.engine.home.q) {
      this.goHome();
      const q = numbersOf("q");
      if (q.length === columns && q.every(Number.isFinite)) this.start = { q };
      return this.askFar({ target: pose, wished: null, joints: null, asked: "pose", gesture: null });
    }
    const signs = [...(parts.get("m") ?? "")];
    this.answer = this.target = null;
    if (signs.length && signs.length === branches.filter(Boolean).length) {
      const branch = this.engine.home.branch.map((side, k) => (branches[k] ? signs.shift() + 1 : side));
      this.answer = { ...this.engine.home, branch: branch.map(Number) };
    }
    return this.ask(pose);
  }
}

/** The pose of the end effector at coordinates of the joints in series that carry it. */
function poseOfSeries({ series, home, length }, values) {
  const off = values.map((value, k) => value - series.coordinates[k].home);
  const motions = series.motions.map(({ kind, axis, point, sign, place }) => {
    const vector = kind === "ball" ? off.slice(place, place + 3) : axis;
    const amount = sign * (kind === "ball" ? norm(vector) : off[place]);
    return kind === "slide" ? shift(scaled(axis, amount)) : turn(unit(vector), amount, scaled(point, length));
  });
  return product(motions.reduce(product, IDENTITY), home);
}
