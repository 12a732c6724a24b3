// The machine as it is drawn: lengths are in units of L, the machine's characteristic length.

/** What moves in the drawing: frames of bodies, points, and solids, at an answer. */
class Scene {
  constructor(machine) {
    this.machine = machine;
    this.drawing = machine.drawing;
    this.length = machine.length;
    this.home = reversed(withLengths(machine.home, 1 / this.length));
    this.names = new Map(this.drawing.points.map((point, k) => [point.joint, k]));
    const home = this.pointsAt(machine.home, new Array(machine.columns).fill(0), machine.homeAnswer?.frames);
    this.homePoints = home;
    this.meshes = this.drawing.parts.map((part) => this.meshOf(part, home));
    this.camera = new Camera(this.drawing, home);
    this.size = this.camera.size;
    this.radius = this.drawing.thickness;
  }

  meshOf(part, home) {
    if (part.kind === "plate") {
      const r = this.drawing.thickness;
      const isBase = part.role === "base";
      const behind = scaled(this.drawing.normal ?? part.axis, part.behind ? -4 * r : 0);
      return plate(part.ends.map((k) => plus(home[k], behind)), part.axis, (isBase ? 3.4 : 2.7) * r, (isBase ? 1.7 : 1.6) * r);
    }
    return part.kind === "mesh" ? faceted(part.vertices, part.faces) : null;
  }

  /** The displacements from home of base, platform, and the other bodies: by joint coordinates, or as Python found them. */
  framesAt(pose, q, given) {
    const frames = [IDENTITY, product(withLengths(pose, 1 / this.length), this.home)];
    if (given) return [...frames, ...given];
    for (const [parent, ...motions] of this.drawing.frames)
      frames.push(motions.reduce((frame, motion) => product(frame, this.moved(motion, q)), frames[parent]));
    return frames;
  }

  moved([column, sign, axis, velocity], q) {
    const value = sign * q[column];
    return norm(axis) ? turn(axis, value, cross(axis, velocity)) : shift(scaled(velocity, value / this.length));
  }

  pointsAt(pose, q, given) {
    const frames = this.framesAt(pose, q, given);
    const points = [];
    for (const { at, frame, amid } of this.drawing.points)
      points.push(amid ? middle(amid.map((k) => points[k])) : placed(frames[frame], at));
    return points;
  }

  /** What tells configurations apart, as the library's fingerprints: end effector, actuators, and centres of joints. */
  marksOf({ pose, q, actuators, frames: given }) {
    const turns = actuators.map((value, k) =>
      this.machine.actuators[k].isAngle ? [Math.cos(value), Math.sin(value)] : [value / this.length],
    );
    const frames = this.framesAt(pose, q, given);
    const end = withLengths(frames[this.drawing.end], 0);
    const joints = this.pointsAt(pose, q, given).filter((_, k) => this.drawing.points[k].joint);
    return [...end, ...scaled(originOf(pose), 1 / this.length), ...turns.flat(), ...joints.flat()];
  }

  /** Place everything at an answer. */
  show({ pose, q, frames }) {
    this.pose = withLengths(pose, 1 / this.length);
    this.frames = this.framesAt(pose, q, frames);
    this.points = this.pointsAt(pose, q, frames);
  }

  /** Solids at the answer, what joints at their limits light up in another colour; and the shapes of bodies, clear. */
  solids(paints, held, distance) {
    const [solids, clear] = [[], []];
    this.drawing.parts.forEach((part, k) => {
      const isShape = part.shape !== undefined, isNearest = isShape && !!distance?.shapes.includes(part.shape);
      const isHeld = part.joints.some((name) => held.has(name)) || (isNearest && distance.isHeld);
      const paint = isHeld ? paints.held : isNearest ? paints.steel : paints[part.paint];
      if (!isShape) this.addPart(solids, part, this.meshes[k], paint);
      else if (!this.hidesSolids) this.addPart(clear, part, this.meshes[k], [...paint.slice(0, 3), isNearest ? 0.3 : 0.16]);
    });
    return { solids, clear };
  }

  addPart(out, part, mesh, paint) {
    const r = this.radius * part.radius;
    const [a, b] = (part.ends ?? []).map((k) => this.points[k]);
    if (part.kind === "ball") out.push({ mesh: BALL, model: ballAt(a, r), paint, gloss: 0.4 });
    else if (part.kind === "bar") {
      if (norm(minus(b, a)) > 1e-4) out.push({ mesh: TUBE, model: tubeFrom(a, b, r), paint, gloss: 0.3 });
    } else if (part.kind === "arc") {
      const line = arcBetween(a, b, part.centre);
      line.slice(1).forEach((end, k) => {
        out.push({ mesh: TUBE, model: tubeFrom(line[k], end, r), paint, gloss: 0.3 });
        out.push({ mesh: BALL, model: ballAt(end, r), paint, gloss: 0.3 });
      });
    } else if (part.kind === "barrel") this.addBarrel(out, a, unit(minus(b, a)), part, paint);
    else if (part.kind === "carriage") {
      const [x, y] = across(part.axis);
      const model = framed(scaled(x, r), scaled(y, r), scaled(part.axis, 1.5 * r), a);
      out.push({ mesh: BOX, model: product(turnOf(this.frames[part.frame], a), model), paint, gloss: 0.2 });
    } else if (part.kind === "rail") out.push({ mesh: TUBE, model: tubeFrom(...part.line, r), paint, gloss: 0.3 });
    else out.push({ mesh, model: this.frames[part.frame], paint, gloss: 0.15 });
  }

  /** The cylinder of a strut, with a collar where its rod comes out. */
  addBarrel(out, start, direction, part, paint) {
    const r = this.radius * part.radius;
    const tip = plus(start, scaled(direction, part.length));
    const collar = plus(start, scaled(direction, part.length - 1.8 * r));
    out.push({ mesh: TUBE, model: tubeFrom(start, tip, r), paint, gloss: 0.3 });
    out.push({ mesh: TUBE, model: tubeFrom(collar, tip, 1.22 * r), paint, gloss: 0.3 });
  }

  /** Where the joints of the platform would be at a pose. */
  platformAt(pose) {
    const frame = product(withLengths(pose, 1 / this.length), this.home);
    return [...this.drawing.platform.map((k) => placed(frame, this.homePoints[k])), originOf(withLengths(pose, 1 / this.length))];
  }

  /** What the platform would be at a pose: clear, with a dashed line to where it is. */
  ghost(pose, paint) {
    const frame = product(withLengths(pose, 1 / this.length), this.home);
    const clear = this.drawing.parts
      .map((part, k) => [part, this.meshes[k]])
      .filter(([part, mesh]) => mesh && part.frame === 1)
      .map(([, mesh]) => ({ mesh, model: frame, paint: [...paint.slice(0, 3), 0.3] }));
    for (const part of this.drawing.parts)
      if (part.kind === "bar" && part.role === "platform") {
        const ends = part.ends.map((k) => placed(frame, this.homePoints[k]));
        if (norm(minus(ends[1], ends[0])) > 1e-4)
          clear.push({ mesh: TUBE, model: tubeFrom(...ends, this.radius * part.radius), paint: [...paint.slice(0, 3), 0.3] });
      }
    const [from, to] = [originOf(this.pose), originOf(withLengths(pose, 1 / this.length))];
    clear.push({ mesh: BALL, model: ballAt(to, 2 * this.radius), paint: [...paint.slice(0, 3), 0.5] });
    return [...clear, ...this.dashes(from, to, [...paint.slice(0, 3), 0.9])];
  }

  dashes(from, to, paint) {
    const count = Math.min(40, Math.floor(norm(minus(to, from)) / (3.2 * this.radius)));
    return Array.from({ length: count }, (_, k) => {
      const ends = [between(from, to, k / count), between(from, to, (k + 0.55) / count)];
      return { mesh: TUBE, model: tubeFrom(...ends, 0.4 * this.radius), paint, kind: FLAT };
    });
  }
}

/** The turn of a displacement, about a point that it has already moved. */
const turnOf = (frame, point) => {
  const about = framed(...[0, 1, 2].map((k) => columnOf(frame, k)), [0, 0, 0]);
  return product(shift(point), product(about, shift(scaled(point, -1))));
};

/** Points of the shorter arc about a centre. */
function arcBetween(start, end, centre) {
  const [a, b] = [minus(start, centre), minus(end, centre)];
  const axis = unit(cross(a, b));
  const angle = Math.atan2(norm(cross(a, b)), dot(a, b));
  const steps = Math.max(1, Math.ceil(angle / 0.15));
  return Array.from({ length: steps + 1 }, (_, k) => placed(turn(axis, (angle * k) / steps, centre), start));
}

const UPRIGHT = Math.PI / 2 - 1e-3, ROOM = 24, MOST_STEPS_BACK = 60;

/** Where the eye is, and what it sees. */
class Camera {
  constructor(drawing, points) {
    this.size = drawing.size;
    this.floor = drawing.floor;
    this.start = { azimuth: drawing.view[0], elevation: drawing.view[1], distance: 2.9 * drawing.size, centre: drawing.centre };
    this.reset();
    this.hidden = 0;
  }

  reset() {
    Object.assign(this, this.start);
  }

  /** Look from a direction, from where the machine is seen as at first. */
  lookFrom([azimuth, elevation]) {
    Object.assign(this, this.start, { azimuth, elevation: clamp(elevation, -UPRIGHT, UPRIGHT) });
  }

  sees(points) {
    const { width, height, covered } = this;
    return points.every((point) => {
      const [x, y] = this.onScreen(point);
      return x > ROOM && x < width * (1 - covered) - ROOM && y > ROOM && y < height - ROOM;
    });
  }

  /** Step back until the points that a function returns are in the picture. */
  keepInView(points) {
    for (let n = 0; n < MOST_STEPS_BACK && !this.sees(points()); n++) {
      this.distance *= 1.06;
      this.look();
    }
  }

  orbit(x, y) {
    this.azimuth -= 0.008 * x;
    this.elevation = clamp(this.elevation + 0.008 * y, -1.5, 1.5);
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.5 * this.size, 9 * this.size);
  }

  pan(x, y, height) {
    const scale = (0.54 * this.distance) / height;
    const [right, up] = this.directions();
    this.centre = plus(this.centre, plus(scaled(right, -x * scale), scaled(up, y * scale)));
  }

  directions() {
    const [ca, sa, ce, se] = [this.azimuth, this.elevation].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    return [[-sa, ca, 0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]];
  }

  /** What is looked at is in the middle of what a panel, which covers a share of the width, leaves. */
  resize(width, height, covered) {
    Object.assign(this, { width, height, covered });
  }

  look() {
    const aspect = this.width / this.height;
    const far = this.distance / Math.min(1, (1 - this.covered) * aspect * 1.1);
    this.eye = plus(this.centre, scaled(this.directions()[2], far));
    const seen = perspective(30 * DEGREE, aspect, 0.02 * far, 9 * far, this.covered);
    this.matrix = product(seen, lookingAt(this.eye, this.centre, AXES[2]));
    return this;
  }

  /** Where a point is on the screen [px]. */
  onScreen(point) {
    const row = (k) => dot(this.matrix.slice(4 * k, 4 * k + 3), point) + this.matrix[4 * k + 3];
    const w = row(3);
    return [((row(0) / w + 1) / 2) * this.width, ((1 - row(1) / w) / 2) * this.height];
  }

  /** The direction from the eye through a point of the screen. */
  ray(x, y) {
    const [a, b] = [(2 * x) / this.width - 1, 1 - (2 * y) / this.height];
    const row = (k) => this.matrix.slice(4 * k, 4 * k + 3);
    return unit(cross(minus(row(0), scaled(row(3), a)), minus(row(1), scaled(row(3), b))));
  }
}
