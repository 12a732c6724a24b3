// The workspace at an orientation and a height: where legs reach, its border found along the lines of a grid.
const BORDER_HALVINGS = 7;

/** A mesh of the area where a test holds, and one of its border, a line of some width: in a plane, its normal upward. */
function areaOf(holds, [[left, right], [low, high]], count, width) {
  const at = (i, j) => [left + ((right - left) * i) / (count - 1), low + ((high - low) * j) / (count - 1)];
  const inside = Array.from({ length: count * count }, (_, k) => holds(...at(k % count, Math.floor(k / count))));
  const crossings = new Map(), area = [], segments = [];
  const fan = (points) => {
    for (let k = 2; k < points.length; k++) for (const [x, y] of [points[0], points[k - 1], points[k]]) area.push(x, y, 0, 0, 0, 1);
  };

  /** Where the border crosses the line between two neighbours; normals of both segments that meet there are summed. */
  const crossing = (a, b) => {
    const key = Math.min(a, b) * 2 + +(Math.abs(a - b) === 1);
    if (!crossings.has(key)) {
      let [within, beyond] = [a, b].map((k) => at(k % count, Math.floor(k / count)));
      if (!inside[a]) [within, beyond] = [beyond, within];
      for (let n = 0; n < BORDER_HALVINGS; n++) {
        const amid = [0, 1].map((k) => (within[k] + beyond[k]) / 2);
        if (holds(...amid)) within = amid;
        else beyond = amid;
      }
      crossings.set(key, { point: within, normal: [0, 0] });
    }
    return crossings.get(key);
  };

  const addCell = (corners) => {
    const outline = [], ends = [];
    corners.forEach((a, k) => {
      const b = corners[(k + 1) % 4];
      if (inside[a]) outline.push(at(a % count, Math.floor(a / count)));
      if (inside[a] === inside[b]) return;
      const end = crossing(a, b);
      outline.push(end.point);
      ends.push(end);
    });
    fan(outline);
    if (!inside[corners[0]]) ends.push(ends.shift()); // each pair leaves the area, and comes back
    for (let k = 0; k + 1 < ends.length; k += 2) segments.push([ends[k], ends[k + 1]]);
  };

  for (let j = 0; j + 1 < count; j++) {
    let begun = -1; // of cells that are wholly within, one after the other
    for (let i = 0; i < count; i++) {
      const k = j * count + i, corners = [k, k + 1, k + count + 1, k + count];
      const sum = i + 1 < count ? corners.filter((each) => inside[each]).length : 0;
      if (sum === 4 && begun < 0) begun = i;
      if (sum < 4 && begun >= 0) {
        fan([at(begun, j), at(i, j), at(i, j + 1), at(begun, j + 1)]);
        begun = -1;
      }
      if (sum > 0 && sum < 4) addCell(corners);
    }
  }
  for (const ends of segments) {
    const [[x, y], [u, v]] = ends.map(({ point }) => point);
    const size = Math.hypot(u - x, v - y) || 1;
    for (const { normal } of ends) (normal[0] += (y - v) / size), (normal[1] += (u - x) / size);
  }
  const border = segments.flatMap((ends) => {
    const [a, b] = ends.map(({ point, normal }) => {
      const [x, y] = normal.map((value) => (width * value) / (Math.hypot(...normal) || 1));
      return [[point[0] - x, point[1] - y], [point[0] + x, point[1] + y]];
    });
    return [a[0], b[0], b[1], a[0], b[1], a[1]].flatMap(([x, y]) => [x, y, 0, 0, 0, 1]);
  });
  return { area, border };
}
