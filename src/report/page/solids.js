// Geometry as lists of numbers for the painter: six a corner of a triangle (place, normal), three a corner of a line.

/** Boxes of the map's data: low corner and size, in drawn cells. */
function readBoxes(map) {
  const bytes = Uint8Array.from(atob(map.boxes), (c) => c.charCodeAt(0));
  const numbers = new DataView(bytes.buffer);
  const boxes = [];
  for (let at = 0; at < bytes.length; at += 12) boxes.push([0, 2, 4, 6, 8, 10].map((k) => numbers.getUint16(at + k, true)));
  return boxes;
}

/** Corners of the faces of a box that look along an axis (0 to 2) and a side (0: low, 1: high), counter-clockwise from outside. */
const FACES = [0, 1, 2].flatMap((axis) => [0, 1].map((side) => {
  const [u, v] = side ? [(axis + 1) % 3, (axis + 2) % 3] : [(axis + 2) % 3, (axis + 1) % 3];
  const corner = (a, b) => { const c = [0, 0, 0]; c[axis] = side; c[u] = a; c[v] = b; return c; };
  const normal = [0, 0, 0];
  normal[axis] = side ? 1 : -1;
  return { normal, corners: [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 0), corner(1, 1), corner(0, 1)] };
}));

/** Faces of all boxes but those that look down. */
function boxFaces(map, boxes) {
  const faces = FACES.filter((face) => face.normal[2] >= 0);
  const out = new Float32Array(boxes.length * faces.length * 36);
  let at = 0;
  for (const box of boxes) {
    for (const { normal, corners } of faces) {
      for (const corner of corners) {
        for (let a = 0; a < 3; a += 1) out[at + a] = map.origin[a] + map.cell * (box[a] + corner[a] * box[3 + a]);
        out.set(normal, at + 3);
        at += 6;
      }
    }
  }
  return out;
}

/** Lines where the surface of the occupied cells bends: where not exactly two neighbouring of the four cells around an edge are occupied. */
function boxCreases(map, boxes) {
  const [nx, ny, nz] = map.dims.map((n) => n + 2);
  if (nx * ny * nz > 3e7) return new Float32Array(0);
  const filled = new Uint8Array(nx * ny * nz);
  const index = (i, j, k) => ((i + 1) * ny + j + 1) * nz + k + 1;
  for (const [x, y, z, dx, dy, dz] of boxes) {
    for (let i = x; i < x + dx; i += 1) for (let j = y; j < y + dy; j += 1) filled.fill(1, index(i, j, z), index(i, j, z + dz));
  }
  const strides = [ny * nz, nz, 1];
  const bends = (cell, u, v) => {
    const [a, b, c, d] = [filled[cell], filled[cell - u], filled[cell - v], filled[cell - u - v]];
    const sum = a + b + c + d;
    return sum === 1 || sum === 3 || (sum === 2 && a === d);
  };
  const out = [], seen = new Set();
  const edge = (corner, axis, length) => {
    const key = `${axis} ${corner} ${length}`;
    if (seen.has(key)) return;
    seen.add(key);
    const [u, v] = [strides[(axis + 1) % 3], strides[(axis + 2) % 3]];
    const place = (n) => { const c = [...corner]; c[axis] += n; return c.map((value, a) => map.origin[a] + map.cell * value); };
    let from = -1;
    for (let n = 0; n <= length; n += 1) {
      const c = [...corner];
      c[axis] += n;
      const on = n < length && bends(index(...c), u, v);
      if (on && from < 0) from = n;
      if (!on && from >= 0) { out.push(...place(from), ...place(n)); from = -1; }
    }
  };
  for (const box of boxes) {
    for (let axis = 0; axis < 3; axis += 1) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      for (const [a, b] of [[0, 0], [1, 0], [0, 1], [1, 1]]) {
        const corner = box.slice(0, 3);
        corner[u] += a * box[3 + u];
        corner[v] += b * box[3 + v];
        edge(corner, axis, box[3 + axis]);
      }
    }
  }
  return Float32Array.from(out);
}

/** The edges of one box, given by two corners in metres. */
function frameLines(min, max) {
  const out = [];
  for (let axis = 0; axis < 3; axis += 1) {
    for (const [a, b] of [[0, 0], [1, 0], [0, 1], [1, 1]]) {
      for (const end of [min, max]) {
        const p = [0, 0, 0];
        p[axis] = end[axis];
        p[(axis + 1) % 3] = (a ? max : min)[(axis + 1) % 3];
        p[(axis + 2) % 3] = (b ? max : min)[(axis + 2) % 3];
        out.push(...p);
      }
    }
  }
  return out;
}

/** Triangles of a shape, each with its own normal. */
function shapeFaces(shape) {
  const out = [], { points, solid: { triangles } } = shape;
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => points[triangles[i + k]]);
    const normal = unit(cross(minus(b, a), minus(c, a)));
    for (const p of [a, b, c]) out.push(...p, ...normal);
  }
  return Float32Array.from(out);
}

/** Lines of a shape. */
const shapeLines = (shape) => Float32Array.from(shape.solid.edges.flatMap((i) => shape.points[i]));

/** Convex outlines on the floor as triangles. */
function floorTriangles(outlines, height) {
  const out = [];
  for (const outline of outlines) {
    for (let i = 2; i < outline.length; i += 1) {
      for (const p of [outline[0], outline[i - 1], outline[i]]) out.push(p[0], p[1], height, 0, 0, 1);
    }
  }
  return Float32Array.from(out);
}

/** A ribbon on the floor along points: six corners a stretch. */
function ribbon(points, width, height) {
  const out = [], h = 0.5 * width;
  for (let i = 1; i < points.length; i += 1) {
    const [[ax, ay], [bx, by]] = [points[i - 1], points[i]];
    const length = Math.hypot(bx - ax, by - ay) || 1;
    const [tx, ty] = [(bx - ax) / length, (by - ay) / length];
    // A little longer at both ends, so that bends have no gaps.
    const [ex, ey, nx, ny] = [tx * h * 0.5, ty * h * 0.5, -ty * h, tx * h];
    const corners = [[ax - ex + nx, ay - ey + ny], [ax - ex - nx, ay - ey - ny], [bx + ex - nx, by + ey - ny], [bx + ex + nx, by + ey + ny]];
    for (const k of [0, 1, 2, 0, 2, 3]) out.push(...corners[k], height, 0, 0, 1);
  }
  return Float32Array.from(out);
}

/** A line along points, cut into dashes of a length; two corners a dash. */
function dashes(points, length, height) {
  const out = [];
  let way = 0;
  for (let i = 1; i < points.length; i += 1) {
    const [[ax, ay], [bx, by]] = [points[i - 1], points[i]];
    const span = Math.hypot(bx - ax, by - ay);
    const at = (v) => [ax + ((bx - ax) * v) / span, ay + ((by - ay) * v) / span, height];
    for (let s = 0; s < span;) {
      const dash = Math.floor(way / length + 1e-6);
      const end = Math.min(span, s + (dash + 1) * length - way);
      if (dash % 2 === 0) out.push(...at(s), ...at(end));
      way += end - s;
      s = end;
    }
  }
  return Float32Array.from(out);
}

/** A circle on the floor as lines. */
function circle([x, y], radius, height) {
  const out = [], at = (k) => [x + radius * Math.cos(k * Math.PI / 24), y + radius * Math.sin(k * Math.PI / 24), height];
  for (let k = 0; k < 48; k += 1) out.push(...at(k), ...at(k + 1));
  return Float32Array.from(out);
}

/** Lines of a floor from `low` to `high` at every whole multiple of `step`. */
function gridLines(low, high, step) {
  const out = [];
  for (let axis = 0; axis < 2; axis += 1) {
    for (let v = Math.ceil(low[axis] / step - 1e-9) * step; v <= high[axis] + 1e-9; v += step) {
      const [a, b] = [[0, 0, 0.001], [0, 0, 0.001]];
      a[axis] = b[axis] = v;
      a[1 - axis] = low[1 - axis];
      b[1 - axis] = high[1 - axis];
      out.push(...a, ...b);
    }
  }
  return Float32Array.from(out);
}
