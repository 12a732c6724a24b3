// The library's kernels, on the tables of one machine: an image of memory that Python wrote, where kernels open it.
const BY_LEGS = 0, EXACTLY = 4;
const PENDING = 9, UNSURE = 10;
const SHORTEST_STEP = 1e-8, MOST_STEPS_OF_TRAVEL = 400;
const INWARD = [1e-13, 1e-12, 1e-11, 1e-10];
const ALIKE = 0.999;
const AT_REST = 1e-7, AT_SPEED = 0.999;
const MOST_BRANCHES = 6, SAME_MODE = 1e-5;
const isSame = (a, b) => a.every((mark, k) => Math.abs(mark - b[k]) <= SAME_MODE);

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { readable, writable } = new DecompressionStream("gzip");
  const writer = writable.getWriter();
  writer.write(bytes).catch(() => {});
  writer.close().catch(() => {});
  return new Response(readable).arrayBuffer();
}

class Engine {
  static async open(kernels, machine) {
    const [code, image] = await Promise.all([unpacked(kernels), unpacked(machine.image.data)]);
    const { instance } = await WebAssembly.instantiate(code, { env: Math });
    return new Engine(instance.exports, machine, new Uint8Array(image));
  }

  constructor(kernels, machine, image) {
    const { memory } = kernels;
    Object.assign(this, { kernels, machine });
    this.base = (kernels.free_memory() + 15) & ~15;
    const missing = this.base + machine.image.size - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / 65536));
    new Uint8Array(memory.buffer).set(image, this.base);
    const words = new Uint32Array(memory.buffer);
    for (const place of machine.image.moved) words[(this.base + place) / 4] += this.base;
    this.question = this.view("question.asked", Object.keys(machine.question).length, BigInt64Array);
    this.status = this.view("answer.status", 1, BigInt64Array);
    const { branches, actuators, columns } = machine;
    const lengths = { poses: 16, sides: branches.length, q: branches.length, actuators: actuators.length, measures: 5, targets: 16, pose: 16 };
    const fields = (record, names) => Object.fromEntries(names.map((name) => [name, this.view(`${record}.${name}`, lengths[name])]));
    this.start = fields("start", ["poses", "sides", "actuators"]);
    this.answer = fields("answer", ["poses", "sides", "q", "actuators", "measures"]);
    this.target = this.view("target.targets", 16);
    this.values = this.view("values.values", actuators.length);
    this.weights = this.view("weights.weights", machine.limits.length);
    this.coordinates = this.view("read.coordinates", columns);
    if (machine.driven.length) {
      this.drives = this.view("live.drives", machine.driven.length * Object.keys(machine.drive).length);
      this.ticked = { ...fields("live", ["targets", "pose", "actuators"]), ...fields("liveScratch", ["measures"]) };
      this.tickStatus = this.view("live.tick", 1, BigInt64Array);
      this.state = fields("liveState", ["pose", "sides", "q"]);
      this.multipliers = this.view("liveHessian.multipliers", machine.multipliers);
    }
    const home = fields("home", ["poses", "sides", "actuators"]);
    this.home = { status: REACHED, pose: [...home.poses], branch: [...home.sides], actuators: [...home.actuators] };
  }

  at(name) {
    return this.base + this.machine.image.places[name];
  }

  view(name, length, Kind = Float64Array) {
    return new Kind(this.kernels.memory.buffer, this.at(name), length);
  }

  /** The status of a target: by some phases, from a start in its working mode, or from home in any. */
  solve(target, start, { last = EXACTLY, keeps = start !== null, tables = "tables" } = {}) {
    this.target.set(target);
    this.prepare(start, last, keeps);
    return this.call("answer_row", "target", tables);
  }

  prepare(start, last, keeps) {
    const from = start ?? this.home;
    this.start.poses.set(from.pose);
    this.start.sides.set(from.branch);
    this.start.actuators.set(from.actuators);
    const asked = { first: BY_LEGS, last, has_start: start !== null, keeps_mode: keeps };
    for (const [name, value] of Object.entries(asked)) this.question[this.machine.question[name]] = BigInt(value);
  }

  call(kernel, asked, tables = "tables") {
    const places = [tables, "scratch", "start", asked, "question.asked", "answer"];
    return this.kernels[kernel](...places.map((name) => this.at(name)));
  }

  /** The answer that a kernel has left in memory. */
  read(status) {
    const { poses, sides, q, actuators, measures } = this.answer;
    const answer = { status, pose: [...poses], branch: [...sides], actuators: [...actuators], errors: [...measures] };
    answer.proximal = [...q];
    return answer;
  }

  ask(target, start = null) {
    const found = this.solve(target, start);
    if (found === PENDING) return this.failed(start ?? this.home);
    if (found === INVALID) return this.failed(start ?? this.home, INVALID);
    const answer = this.read(found === UNSURE ? PROJECTED : found);
    if (answer.status !== PROJECTED) return this.complete(answer);
    if (!answer.proximal.some(Number.isNaN)) answer.limits = this.holding();
    return this.complete(this.rested(answer, start ?? this.home));
  }

  /** A projection whose arms, if poses leave them open, are no farther from its start than its pose asks for. */
  rested(answer, start) {
    const { arms } = this.machine;
    if (!arms.length || this.solve(answer.pose, start, { last: BY_LEGS }) !== REACHED) return answer;
    const far = ({ branch }) => Math.hypot(...arms.map((k) => branch[k] - start.branch[k]));
    const { branch, actuators, proximal } = this.read(REACHED);
    return far({ branch }) < far(answer) ? { ...answer, branch, actuators, proximal } : answer;
  }

  /** True if no motion leads from a start to an answer as its target goes on: the way back does not undo the step. */
  jumps(start, before, target, answer) {
    const { jump, length, actuators } = this.machine;
    const unit = (k) => (actuators[k].isAngle ? 1 : length);
    const step = (other) => Math.max(...start.actuators.map((value, k) => Math.abs(other.actuators[k] - value) / unit(k)));
    const asked = Math.hypot(norm(minus(originOf(target), originOf(before))), jump.turning * angleBetween(before, target));
    if (!(step(answer) > Math.max((jump.suspicious * asked) / length, jump.moved))) return false;
    const back = this.ask(before, answer);
    return back.actuators !== null && step(back) > jump.undone * step(answer);
  }

  /** Forward kinematics, in the assembly mode of a start. */
  assemble(values, start = null) {
    this.values.set(values);
    this.prepare(start, EXACTLY, true);
    const status = this.call("assemble_row", "values");
    return status === PENDING ? this.failed(start ?? this.home) : this.complete(this.read(status));
  }

  failed(start, status = FAILED) {
    const answer = { ...start, status, errors: [0, 0, 0, 0, 0], proximal: null, limits: [] };
    return { ...this.complete(answer), actuators: null };
  }

  /** An answer with its joint coordinates, and the limits that it lies on. */
  complete(answer) {
    answer.q = this.coordinatesOf(answer);
    if (!answer.limits?.length) answer.limits = this.active(answer.q);
    return answer;
  }

  coordinatesOf({ pose, branch, proximal, actuators }) {
    const { kernels, coordinates } = this;
    this.answer.poses.set(pose);
    this.answer.sides.set(branch);
    this.answer.q.set(proximal ?? branch.map(() => NaN));
    coordinates.fill(0);
    const places = ["reading", "readingScratch", "&answer.poses", "&answer.sides", "&answer.q"];
    const filled = ["&read.coordinates", "&read.no_rows", "&read.no_slopes"];
    kernels.evaluate_poses(...[...places, ...filled].map((name) => this.at(name)));
    this.machine.actuators.forEach(({ column, home }, k) => (coordinates[column] = actuators[k] - home));
    return [...coordinates];
  }

  /** Let the machine rest at an answer, where drives begin; false where that is beyond limits. */
  rest({ status, pose, branch, actuators }) {
    if (!actuators || status > PROJECTED) return false;
    const { machine, state } = this;
    state.pose.set(withLengths(pose, 1 / machine.length));
    state.sides.set(branch);
    state.q.fill(0);
    this.multipliers.fill(0);
    this.kernels.place(this.at("live"), this.at("liveScratch"));
    machine.driven.forEach((_, k) => {
      this.drives[this.placeOf(k, "rate")] = 0;
      this.drives[this.placeOf(k, "aim")] = NaN;
    });
    return true;
  }

  placeOf(k, field) {
    return k * Object.keys(this.machine.drive).length + this.machine.drive[field];
  }

  /** Some seconds on towards a target, at most as fast as drives may [length or rad, per s]: the answer there. */
  tick(target, seconds, speeds) {
    const { drives, ticked, state, machine } = this;
    machine.driven.forEach(([column, unit], k) => (drives[this.placeOf(k, "speed")] = speeds[column] / unit));
    const before = [...ticked.actuators];
    ticked.targets.set(target);
    this.kernels.go_on(this.at("live"), this.at("liveScratch"), seconds);
    const answer = {
      status: Number(this.tickStatus[0]), pose: [...ticked.pose], branch: [...state.sides], proximal: [...state.q],
      actuators: [...ticked.actuators], errors: [...ticked.measures],
    };
    const shares = answer.actuators.map((value, k) => Math.abs(value - before[k]) / (speeds[k] * seconds));
    answer.isMoving = Math.max(...shares) > AT_REST;
    const fast = machine.actuators.filter((_, k) => shares[k] > AT_SPEED).map(({ joint }) => ({ joint, bound: "speed" }));
    answer.isOnItsWay = answer.status === PROJECTED && fast.length > 0;
    this.complete(answer);
    if (answer.isOnItsWay) answer.limits.unshift(...fast);
    if (answer.status !== PROJECTED || answer.isOnItsWay) return answer;
    this.target.set(target);
    return { ...answer, limits: this.holding() };
  }

  /** The limits that hold the answer in memory back, the largest multiplier first; like ones as they are described. */
  holding() {
    const places = ["tables", "scratch", "weighing", "&target.targets", "answer", "&weights.weights"];
    this.kernels.weigh_limits(...places.map((name) => this.at(name)));
    const { limits, holding, ranges } = this.machine;
    const isRigid = (k) => k < 2 * ranges.length && !(ranges[k >> 1][1] < ranges[k >> 1][2]);
    const held = limits.map((limit, k) => ({ ...limit, weight: this.weights[k], isRigid: isRigid(k) }));
    const sorted = held.filter(({ weight }) => weight > holding).sort((a, b) => b.weight - a.weight);
    let leader = Infinity;
    for (const limit of sorted) {
      if (!(limit.weight > ALIKE * leader)) leader = limit.weight;
      limit.group = leader;
    }
    sorted.sort((a, b) => b.group - a.group || a.place - b.place);
    return sorted.filter((limit) => !limit.isRigid);
  }

  /** The limits that joint coordinates lie on. */
  active(q) {
    const { ranges, limits, active } = this.machine;
    const on = [];
    ranges.forEach(([column, low, high, unit], k) => {
      if (low < high && q[column] - low <= active * unit) on.push(limits[2 * k]);
      else if (low < high && high - q[column] <= active * unit) on.push(limits[2 * k + 1]);
    });
    return on;
  }

  get axes() {
    return axesOf(this.machine.task);
  }

  // An answer that legs reach again. Where links are stretched out, rounding decides if they do: then it is one within
  // reach beside it, towards home or along the axes of the task, nearer than a pose's tolerance.
  steady(answer) {
    if (!answer.actuators) return answer;
    const { home, machine } = this;
    const isSteady = (pose) => this.solve(pose, answer, { last: BY_LEGS }) === REACHED;
    if (isSteady(answer.pose)) return answer;
    const moves = this.axes.map(([kind, axis]) => [kind, axisOf(machine.task, kind, axis, answer.pose)]);
    const away = minus(originOf(home.pose), originOf(answer.pose));
    if (norm(away) > 0) moves.unshift(["along", unit(away)]);
    for (const amount of INWARD)
      for (const [kind, vector] of moves)
        for (const sign of [1, -1]) {
          const pose = displaced(answer.pose, kind, vector, sign * amount * (kind === "along" ? machine.length : 1));
          if (isSteady(pose)) return { ...answer, ...this.read(REACHED), isBeside: true };
        }
    return answer;
  }

  /** How far the end effector goes each way along and about each axis of the task, and what stops it. */
  travel(from) {
    return this.axes.flatMap(([kind, axis]) => [-1, 1].map((sign) => this.reach(from, kind, axis, sign)));
  }

  reach(from, kind, axis, sign) {
    const { length } = this.machine;
    const [scale, most] = kind === "along" ? [length, 4] : [1, 2 * Math.PI];
    const vector = axisOf(this.machine.task, kind, axis, from.pose);
    const at = (amount) => displaced(from.pose, kind, vector, sign * amount * scale);
    let [amount, step, last] = [0, 1 / 32, from];
    for (let n = 0; n < MOST_STEPS_OF_TRAVEL && amount < most && step > SHORTEST_STEP; n++) {
      const next = Math.min(amount + step, most);
      if (this.solve(at(next), last, { last: BY_LEGS }) === REACHED) [amount, last] = [next, this.read(REACHED)];
      else step /= 4;
    }
    const isFree = amount >= most;
    const limits = isFree ? [] : this.stopping(at(amount + 1e-3), last);
    return { kind, axis, sign, distance: isFree ? Infinity : amount * scale, limits, pose: at(amount) };
  }

  /** The limits that a pose lies on, or else those that hold it back from a target just beyond. */
  stopping(beyond, last) {
    const limits = this.active(this.coordinatesOf(last));
    if (limits.length) return limits;
    const answer = this.ask(beyond, last);
    return answer.status === PROJECTED ? answer.limits : [];
  }

  // The working modes of an answer's target, and of the platform's other poses where the task leaves some of it open, in
  // the library's order: nearest to home first. They are the same from each of them. Marks tell configurations apart.
  modes(from, marksOf) {
    const places = this.machine.branches.flatMap((side, k) => (side ? [k] : []));
    if (places.length > MOST_BRANCHES) return [];
    const modes = [], home = marksOf({ ...this.home, q: new Array(this.machine.columns).fill(0) });
    for (const start of [this.home, ...this.others(), from])
      for (let bits = 0; bits < 2 ** places.length; bits++) {
        const branch = [...start.branch];
        places.forEach((k, i) => (branch[k] = bits & (1 << i) ? -1 : 1));
        const mode = this.mode(from.pose, { ...start, branch, actuators: from.actuators });
        const marks = mode && marksOf(mode);
        if (mode && !modes.some((other) => isSame(marks, other.marks))) modes.push({ ...mode, marks });
      }
    // Equal distances stay in the order of the branches, whatever rounding makes of them.
    const distance = ({ marks }) => Math.round(1e9 * marks.reduce((sum, mark, k) => sum + (mark - home[k]) ** 2, 0));
    return modes.sort((a, b) => distance(a) - distance(b));
  }

  /** A pose on some sides of the legs, within limits or beyond; null where the legs do not meet. */
  mode(pose, start) {
    for (const [tables, status] of [["tables", REACHED], ["free", EXCEEDED]]) {
      if (this.solve(pose, start, { last: BY_LEGS, keeps: false, tables }) === REACHED) {
        return this.complete(this.read(status));
      }
    }
    return null;
  }

  others() {
    const { others, branches, length } = this.machine;
    const [poses, sides] = [this.view("others.poses", 16 * others), this.view("others.sides", branches.length * others)];
    return Array.from({ length: others }, (_, k) => ({
      pose: withLengths([...poses.subarray(16 * k, 16 * (k + 1))], length),
      branch: [...sides.subarray(branches.length * k, branches.length * (k + 1))],
    }));
  }

  /** A test for points along two axes [length]: if legs reach them at an answer's orientation, in its mode. */
  reachTest(from, [u, v]) {
    this.solve(from.pose, from, { last: BY_LEGS });
    return (x, y) => {
      this.target[4 * u + 3] = x;
      this.target[4 * v + 3] = y;
      return this.call("answer_row", "target") === REACHED;
    };
  }
}

/** The axes of a task, along and about which the end effector moves. */
const axesOf = (task) => [...task.slides.map((axis) => ["along", axis]), ...task.turns.map((axis) => ["about", axis])];

/** No answers but those that the page was written with. */
class StillEngine {
  constructor(machine) {
    Object.assign(this, { machine, isStill: true, home: received(machine.homeAnswer) });
  }

  get axes() {
    return axesOf(this.machine.task);
  }
}
