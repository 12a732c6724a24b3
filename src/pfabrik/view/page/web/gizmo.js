// The handles at what is asked for: an arrow for each direction, a ring for each axis that the task has.
class Gizmo {
  constructor(machine, scene) {
    this.scene = scene;
    this.task = machine.task;
    this.normal = machine.drawing.normal;
    this.parts = [
      ...this.task.slides.map((axis) => ({ kind: "along", axis })),
      ...this.task.turns.map((axis) => ({ kind: "about", axis })),
    ];
    this.free = { kind: this.task.slides.length ? "free" : "tilt", axis: 0 };
    this.hot = null;
  }

  /** The axes of the handles: those of the base, or of the platform where the task is a tilt. */
  axis({ kind, axis }) {
    return axisOf(this.task, kind, axis, this.target);
  }

  /** Put the handles where the target is; where it sets no position, where the platform is. */
  show(target, pose) {
    this.target = target;
    this.centre = scaled(originOf(this.task.slides.length ? target : pose), 1 / this.scene.length);
  }

  get size() {
    return Math.max(0.16 * this.scene.size, 0.085 * this.scene.camera.distance);
  }

  model(part, size) {
    const z = this.axis(part);
    const [x, y] = across(z);
    return framed(scaled(x, size), scaled(y, size), scaled(z, size), this.centre);
  }

  handles(paints) {
    if (this.isStill) return [];
    const { size, hot } = this;
    const out = this.parts.map((part) => {
      const isHot = hot === part;
      const colour = paints.axes[part.axis];
      const paint = [...(isHot ? between(colour, paints.bright, 0.45) : colour), hot && !isHot ? 0.35 : 0.96];
      const isRing = part.kind === "about";
      const model = this.model(part, isRing ? 0.72 * size : size);
      return { mesh: isRing ? RING : ARROW, model, paint, gloss: 0.1, kind: isRing ? HANDLE : SURFACE };
    });
    if (this.free.kind === "free") {
      const paint = [...(hot === this.free ? paints.bright : paints.ink), 0.96];
      out.push({ mesh: BALL, model: ballAt(this.centre, 0.085 * size), paint });
    }
    return out;
  }

  /** The letters at the tips of arrows: text, place and axis. */
  get letters() {
    const tips = this.isStill ? [] : this.parts.filter((part) => part.kind === "along");
    return tips.map((part) => ["xyz"[part.axis], plus(this.centre, scaled(this.axis(part), 1.13 * this.size)), part.axis]);
  }

  /** The handle at a point of the screen, or the platform itself; null where there is none within so many pixels. */
  pick(x, y, slack) {
    if (this.isStill) return null;
    const { camera } = this.scene;
    let [best, least] = [null, slack];
    const offer = (part, distance) => {
      if (distance < least) [best, least] = [part, distance];
    };
    if (this.free.kind === "free") offer(this.free, 0.8 * apart([x, y], camera.onScreen(this.centre)));
    for (const part of this.parts) {
      const line = this.outline(part).map((point) => camera.onScreen(point));
      for (let k = 0; k + 1 < line.length; k++) offer(part, fromSegment([x, y], line[k], line[k + 1]));
    }
    return best ?? (this.isOnPlatform(x, y) ? this.free : null);
  }

  outline(part) {
    const { centre, size } = this;
    if (part.kind === "along") return [0.15, 1].map((share) => plus(centre, scaled(this.axis(part), share * size)));
    const model = this.model(part, 0.72 * size);
    const { eye } = this.scene.camera;
    const ring = Array.from({ length: 49 }, (_, n) => (n * Math.PI) / 24);
    const points = ring.map((angle) => placed(model, [Math.cos(angle), Math.sin(angle), 0]));
    return points.filter((point) => dot(minus(point, centre), minus(eye, centre)) > -0.1 * size * norm(minus(eye, centre)));
  }

  isOnPlatform(x, y) {
    const { camera, points, drawing } = this.scene;
    const ends = drawing.platform.map((k) => camera.onScreen(points[k]));
    const centre = [0, 1].map((k) => ends.reduce((sum, end) => sum + end[k], 0) / ends.length);
    return apart([x, y], centre) < Math.max(20, 0.75 * Math.max(...ends.map((end) => apart(end, centre))));
  }

  /** Take hold of a handle. */
  grab(part, x, y) {
    const held = { part, start: [...this.target], centre: this.centre, axis: this.axis(part), at: [x, y] };
    held.from = this.value(held, x, y);
    held.last = held.from;
    held.sum = 0;
    return held;
  }

  /** Where a pointer is, along or about an axis, or in the plane of view. */
  value(held, x, y) {
    const { camera } = this.scene;
    const [way, toEye, { axis, centre }] = [camera.ray(x, y), minus(camera.eye, held.centre), held];
    const hit = (normal) => plus(camera.eye, scaled(way, -dot(toEye, normal) / (dot(way, normal) || 1e-9)));
    if (held.part.kind === "free") return hit(this.normal ?? unit(toEye));
    if (held.part.kind === "along") return dot(minus(hit(unit(cross(cross(axis, toEye), axis))), centre), axis);
    if (held.part.kind === "tilt") return [x, y];
    if (Math.abs(dot(way, axis)) < 0.12) return (x + y) / 90; // a ring that is seen from its side
    const [[u, v], point] = [across(axis), minus(hit(axis), centre)];
    return Math.atan2(dot(point, v), dot(point, u));
  }

  /** The target that a pointer moves a handle to. */
  drag(held, x, y) {
    const { part, start, from, axis } = held;
    const now = this.value(held, x, y);
    if (part.kind === "about") {
      held.sum += Math.atan2(Math.sin(now - held.last), Math.cos(now - held.last));
      held.last = now;
      return displaced(start, part.kind, axis, held.sum);
    }
    if (part.kind === "along") return displaced(start, part.kind, axis, (now - from) * this.scene.length);
    return part.kind === "free" ? this.freely(start, minus(now, from)) : this.tilted(start, now[0] - from[0], now[1] - from[1]);
  }

  freely(start, offset) {
    return this.task.slides.reduce(
      (target, axis) => displaced(target, "along", AXES[axis], offset[axis] * this.scene.length), start);
  }

  /** Turned as if the pointer rolled a ball under the platform. */
  tilted(start, right, down) {
    const [toRight, up] = this.scene.camera.directions();
    const sum = plus(scaled(up, 0.008 * right), scaled(toRight, 0.008 * down));
    return this.task.turns.reduce((target, axis) => {
      const about = this.axis({ kind: "about", axis });
      return displaced(target, "about", about, dot(sum, about));
    }, start);
  }
}

/** An axis of the task: of the base, or of the platform where the task is a tilt. */
function axisOf(task, kind, axis, pose) {
  if (kind === "about" && task.only) return task.only;
  return kind === "about" && task.rotations === 2 ? columnOf(pose, axis) : AXES[axis];
}

const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
function fromSegment(p, a, b) {
  const [x, y] = [b[0] - a[0], b[1] - a[1]];
  const share = clamp(((p[0] - a[0]) * x + (p[1] - a[1]) * y) / (x * x + y * y || 1), 0, 1);
  return apart(p, [a[0] + share * x, a[1] + share * y]);
}

/** A pose moved along an axis [length], or turned about it through its own origin [rad]. */
function displaced(pose, kind, axis, amount) {
  return product(kind === "along" ? shift(scaled(axis, amount)) : turn(axis, amount, originOf(pose)), pose);
}
