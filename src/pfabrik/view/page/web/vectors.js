// Vectors of three numbers, and matrices of 4 x 4 by rows, as poses are written.
const AXES = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scaled(a, 1 / (norm(a) || 1));
const between = (a, b, share) => plus(a, scaled(minus(b, a), share));
const middle = (points) => scaled(points.reduce(plus), 1 / points.length);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
/** Two unit vectors that are square to a unit vector, and to each other. */
function across(axis) {
  const first = unit(cross(Math.abs(axis[2]) < 0.9 ? AXES[2] : AXES[0], axis));
  return [first, cross(axis, first)];
}

/** The matrix that takes the axes of a frame to three vectors, and its origin to a point. */
const framed = (x, y, z, p) => [x[0], y[0], z[0], p[0], x[1], y[1], z[1], p[1], x[2], y[2], z[2], p[2], 0, 0, 0, 1];
const IDENTITY = framed(...AXES, [0, 0, 0]);
const columnOf = (matrix, k) => [matrix[k], matrix[4 + k], matrix[8 + k]];
const originOf = (matrix) => columnOf(matrix, 3);
const placed = (matrix, point) =>
  [0, 4, 8].map((i) => matrix[i] * point[0] + matrix[i + 1] * point[1] + matrix[i + 2] * point[2] + matrix[i + 3]);

function product(a, b) {
  const out = new Array(16);
  for (let i = 0; i < 16; i += 4)
    for (let j = 0; j < 4; j++)
      out[i + j] = a[i] * b[j] + a[i + 1] * b[4 + j] + a[i + 2] * b[8 + j] + a[i + 3] * b[12 + j];
  return out;
}

/** The inverse of a displacement. */
function reversed(matrix) {
  const rows = [0, 4, 8].map((i) => matrix.slice(i, i + 3));
  const origin = [0, 1, 2].map((k) => -dot(columnOf(matrix, k), originOf(matrix)));
  return framed(...rows, origin);
}

/** A turn about a unit axis through a point. */
function turn(axis, angle, point = [0, 0, 0]) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const columns = AXES.map((e) =>
    plus(plus(scaled(e, c), scaled(cross(axis, e), s)), scaled(axis, dot(axis, e) * (1 - c))),
  );
  const about = framed(...columns, [0, 0, 0]);
  return framed(...columns, minus(point, placed(about, point)));
}
const shift = (vector) => framed(...AXES, vector);

/** A pose with its lengths times a factor. */
const withLengths = (pose, factor) => pose.map((value, k) => (k % 4 === 3 && k < 12 ? value * factor : value));

const DEGREE = Math.PI / 180;
/** Angles in degrees about the fixed axes x, then y, then z. */
function anglesOf(pose) {
  const pitch = Math.asin(clamp(-pose[8], -1, 1));
  return [Math.atan2(pose[9], pose[10]), pitch, Math.atan2(pose[4], pose[0])].map((angle) => angle / DEGREE);
}
/** The angle of the rotation that turns one pose into another [rad]. */
function angleBetween(a, b) {
  const column = (m, k) => [m[k], m[k + 4], m[k + 8]];
  const axis = [0, 1, 2].map((k) => cross(column(a, k), column(b, k))).reduce(plus);
  const cosine = [0, 1, 2].reduce((sum, k) => sum + dot(column(a, k), column(b, k)), -1);
  return Math.atan2(norm(axis), cosine);
}

function poseOf(position, angles) {
  const turns = angles.map((angle, k) => turn(AXES[k], angle * DEGREE));
  const pose = product(turns[2], product(turns[1], turns[0]));
  position.forEach((value, k) => (pose[4 * k + 3] = value));
  return pose;
}

// How a camera sees.
function lookingAt(eye, point, up) {
  const z = unit(minus(eye, point));
  const x = unit(cross(up, z));
  return reversed(framed(x, cross(z, x), z, eye));
}
/** A perspective of an angle up and down; what is looked at moves sideways by a share of half the picture. */
function perspective(angle, aspect, near, far, sideways = 0) {
  const f = 1 / Math.tan(angle / 2);
  const [depth, offset] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
  return [f / aspect, 0, sideways, 0, 0, f, 0, 0, 0, 0, depth, offset, 0, 0, -1, 0];
}
/** Parallel rays, for the shadows of a distant sun. */
function parallel(radius, near, far) {
  return [1 / radius, 0, 0, 0, 0, 1 / radius, 0, 0, 0, 0, -2 / (far - near), -(far + near) / (far - near), 0, 0, 0, 1];
}
