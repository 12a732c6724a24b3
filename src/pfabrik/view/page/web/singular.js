// How near an answer is to singularities: the least ratio of the platform's speed to the actuators', and the reverse.
const STEP = 1e-4, LEAST_STEP = 1e-8, MOST_SWEEPS = 12, LEADS = 0.75;

// Both measures, as of `singularity`, the actuator that leads the most expensive motion, and the side of singularities: 1
// or -1, changed by each one passed. Where legs stop it both ways serial is 0, and the rest unknown; null for machines
// with more actuators than freedoms.
function singularityOf(engine, from) {
  const { actuators, task, length } = engine.machine;
  const { axes } = engine;
  if (axes.length !== actuators.length) return null;
  const motions = axes.map(([kind, axis]) => motionOf(engine, from, kind, axisOf(task, kind, axis, from.pose)));
  if (motions.some((motion) => motion === null)) return { serial: 0, parallel: NaN, leg: "", side: NaN };
  const rates = motions.map((motion) => motion.rates.map((rate, k) => rate / (actuators[k].isAngle ? 1 : length)));
  const squares = (vectors) => vectors.map((a) => vectors.map((b) => a.reduce((sum, value, k) => sum + value * b[k], 0)));
  const perTwist = solved(choleskyOf(squares(motions.map((motion) => motion.twist))), rates);
  const [values, vectors] = eigenOf(squares(perTwist));
  const largest = values.indexOf(Math.max(...values));
  const shares = actuators.map((_, i) => perTwist.reduce((sum, row, k) => sum + vectors[k][largest] * row[i], 0));
  const leader = shares.findIndex((share) => Math.abs(share) > LEADS * Math.hypot(...shares));
  const leg = leader < 0 ? "" : actuators[leader].name;
  const parallel = Math.sqrt(Math.max(Math.min(...values), 0));
  return { serial: 1 / Math.sqrt(values[largest]), parallel, leg, side: Math.sign(determinantOf(perTwist)) };
}

/** A twist [L and rad] and the actuators' rates, by the difference of answers to both sides or, at a dead point, to one. */
function motionOf(engine, from, kind, axis) {
  const { length } = engine.machine;
  const move = from.isBeside ? LEAST_STEP : STEP;
  const ends = [1, -1].map((sign) => {
    const target = displaced(from.pose, kind, axis, sign * move * (kind === "along" ? length : 1));
    const isReached = engine.solve(target, from, { last: BY_LEGS, tables: "free" }) === REACHED;
    return isReached ? engine.read(REACHED) : null;
  });
  const [more, less] = ends.map((end) => end ?? from);
  const step = move * ends.filter(Boolean).length;
  if (!step) return null;
  const turned = product(withLengths(more.pose, 0), reversed(withLengths(less.pose, 0)));
  const about = [turned[9] - turned[6], turned[2] - turned[8], turned[4] - turned[1]].map((value) => value / (2 * step));
  const along = scaled(minus(originOf(more.pose), originOf(less.pose)), 1 / (step * length));
  return { twist: [...along, ...about], rates: more.actuators.map((value, k) => (value - less.actuators[k]) / step) };
}

function determinantOf([row, ...rest]) {
  if (!row) return 1;
  const without = (k) => rest.map((other) => other.filter((_, i) => i !== k));
  return row.reduce((sum, value, k) => sum + (value && (k % 2 ? -value : value) * determinantOf(without(k))), 0);
}

/** The lower triangular root of a positive matrix. */
function choleskyOf(matrix) {
  const root = matrix.map((row) => row.map(() => 0));
  matrix.forEach((row, i) => {
    for (let j = 0; j <= i; j++) {
      const rest = row[j] - root[i].reduce((sum, value, k) => sum + (k < j ? value * root[j][k] : 0), 0);
      root[i][j] = i === j ? Math.sqrt(Math.max(rest, 1e-300)) : rest / root[j][j];
    }
  });
  return root;
}

/** Rows with the inverse of a lower triangular matrix before them. */
function solved(root, rows) {
  const out = [];
  rows.forEach((row, i) => {
    out.push(row.map((value, c) => (value - out.reduce((sum, done, k) => sum + root[i][k] * done[c], 0)) / root[i][i]));
  });
  return out;
}

/** Eigenvalues and eigenvectors, in columns, of a symmetric matrix, by rotations. */
function eigenOf(matrix) {
  const [a, n] = [matrix.map((row) => [...row]), matrix.length];
  const vectors = a.map((_, i) => a.map((_, j) => +(i === j)));
  for (let sweep = 0; sweep < MOST_SWEEPS; sweep++)
    for (let p = 0; p < n; p++)
      for (let q = p + 1; q < n; q++) {
        const angle = 0.5 * Math.atan2(2 * a[p][q], a[q][q] - a[p][p]);
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        const rotate = (x, y) => [c * x - s * y, s * x + c * y];
        for (const row of [...a, ...vectors]) [row[p], row[q]] = rotate(row[p], row[q]);
        for (let k = 0; k < n; k++) [a[p][k], a[q][k]] = rotate(a[p][k], a[q][k]);
      }
  return [a.map((row, k) => row[k]), vectors];
}
