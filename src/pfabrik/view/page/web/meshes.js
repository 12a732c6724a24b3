// Meshes: triangles as six numbers a corner, its place and its normal.

/** A profile turned about z: pairs of rings, each [radius, height, normal outward, normal upward]. */
function turned(rings, steps = 28) {
  const out = [];
  const corner = ([radius, height, outward, upward], angle) => {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    out.push(radius * c, radius * s, height, outward * c, outward * s, upward);
  };
  for (let k = 0; k + 1 < rings.length; k += 2)
    for (let n = 0; n < steps; n++) {
      const [a, b] = [(2 * Math.PI * n) / steps, (2 * Math.PI * (n + 1)) / steps];
      corner(rings[k], a), corner(rings[k], b), corner(rings[k + 1], b);
      corner(rings[k], a), corner(rings[k + 1], b), corner(rings[k + 1], a);
    }
  return out;
}
/** The rings of an arc of radius r in the plane of the profile, about a point at a distance from the axis. */
function arcRings(from, to, steps, r = 1, distance = 0) {
  const ring = (k) => {
    const angle = from + ((to - from) * k) / steps;
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    return [distance + r * c, r * s, c, s];
  };
  return Array.from({ length: steps }, (_, k) => [ring(k), ring(k + 1)]).flat();
}

const TUBE = turned([
  [0, 0, 0, -1], [1, 0, 0, -1],
  [1, 0, 1, 0], [1, 1, 1, 0],
  [1, 1, 0, 1], [0, 1, 0, 1],
]);
const BALL = turned(arcRings(-Math.PI / 2, Math.PI / 2, 16));
const RING = turned(arcRings(0, 2 * Math.PI, 12, 0.02, 1), 72);
const ARROW = turned([
  [0.024, 0.12, 1, 0], [0.024, 0.8, 1, 0],
  [0, 0.8, 0, -1], [0.072, 0.8, 0, -1],
  [0.072, 0.8, 0.94, 0.34], [0, 1, 0.94, 0.34],
]);
const SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].flatMap((corner) => [...corner, 0, 0, 0, 1]);
const BOX = boxOf();

function boxOf() {
  const out = [];
  for (let axis = 0; axis < 3; axis++)
    for (const side of [-1, 1])
      for (let k = 0; k < SQUARE.length; k += 6) {
        const [place, normal] = [[0, 0, 0], [0, 0, 0]];
        place[axis] = normal[axis] = side;
        place[(axis + 1) % 3] = SQUARE[k];
        place[(axis + 2) % 3] = SQUARE[k + 1];
        out.push(...place, ...normal);
      }
  return out;
}

/** A convex plate around points of a plane, its corners round with a radius, its edge chamfered. */
function plate(points, axis, radius, thickness) {
  const [centre, [x, y]] = [middle(points), across(axis)];
  const flat = points.map((point) => [dot(minus(point, centre), x), dot(minus(point, centre), y)]);
  const round = flat.flatMap(([u, v]) =>
    Array.from({ length: 40 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 40;
      return [u + radius * Math.cos(angle), v + radius * Math.sin(angle)];
    }),
  );
  const rim = hullOf(round);
  const out = [];
  const bevel = 0.22 * thickness;
  const corner = ([u, v], height, normal) =>
    out.push(...plus(centre, plus(scaled(axis, height), plus(scaled(x, u), scaled(y, v)))), ...normal);
  const outward = rim.map((p, k) => {
    const [before, after] = [rim[(k + rim.length - 1) % rim.length], rim[(k + 1) % rim.length]];
    return unit([after[1] - before[1], before[0] - after[0], 0]);
  });
  const inner = rim.map((p, k) => [p[0] - bevel * outward[k][0], p[1] - bevel * outward[k][1]]);
  const normals = outward.map((n) => plus(scaled(x, n[0]), scaled(y, n[1])));
  rim.forEach((_, k) => {
    const next = (k + 1) % rim.length;
    for (const side of [-1, 1]) {
      const [high, edge] = [(side * thickness) / 2, side * (thickness / 2 - bevel)];
      for (const p of [[0, 0], inner[k], inner[next]]) corner(p, high, scaled(axis, side));
      const slope = (n) => unit(plus(n, scaled(axis, side)));
      quad(corner, [rim[k], edge, slope(normals[k])], [rim[next], edge, slope(normals[next])],
        [inner[next], high, slope(normals[next])], [inner[k], high, slope(normals[k])]);
    }
    const edge = thickness / 2 - bevel;
    quad(corner, [rim[k], -edge, normals[k]], [rim[next], -edge, normals[next]],
      [rim[next], edge, normals[next]], [rim[k], edge, normals[k]]);
  });
  return out;
}
function quad(corner, a, b, c, d) {
  for (const each of [a, b, c, a, c, d]) corner(...each);
}

/** The convex hull of points of a plane, counter-clockwise. */
function hullOf(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turnOf = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turnOf(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** Flat faces of a solid: its vertices three numbers each, and three indices a triangle. */
const faceted = (vertices, faces) => trianglesOf(faces.map((k) => vertices.slice(3 * k, 3 * k + 3)));

/** Flat triangles: three points each. */
function trianglesOf(points) {
  const out = [];
  for (let k = 0; k + 2 < points.length; k += 3) {
    const normal = unit(cross(minus(points[k + 1], points[k]), minus(points[k + 2], points[k])));
    for (const corner of points.slice(k, k + 3)) out.push(...corner, ...normal);
  }
  return out;
}

/** Thin prisms along segments: pairs of points. */
function wires(segments, radius, sides = 5) {
  const out = [];
  for (const [a, b] of segments) {
    if (!(norm(minus(b, a)) > 0)) continue;
    const [x, y] = across(unit(minus(b, a)));
    const outward = (n) => plus(scaled(x, Math.cos((2 * Math.PI * n) / sides)), scaled(y, Math.sin((2 * Math.PI * n) / sides)));
    for (let n = 0; n < sides; n++) {
      const corner = (end, normal) => out.push(...plus(end, scaled(normal, radius)), ...normal);
      quad(corner, [a, outward(n)], [a, outward(n + 1)], [b, outward(n + 1)], [b, outward(n)]);
    }
  }
  return out;
}

// Where a mesh of size one is put.
const ballAt = (point, radius) => framed(...AXES.map((axis) => scaled(axis, radius)), point);
function tubeFrom(start, end, radius) {
  const [x, y] = across(unit(minus(end, start)));
  return framed(scaled(x, radius), scaled(y, radius), minus(end, start), start);
}
