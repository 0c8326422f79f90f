// Rigid frames as twelve numbers (three rows of four), projections as sixteen (columns, as WebGL takes them).

/** Frame of a translation and a unit quaternion (x, y, z, w). */
function frameOf([tx, ty, tz, x, y, z, w]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), tx,
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), ty,
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), tz,
  ];
}

/** Frame of the base on the floor. */
function frameOfPose([x, y, yaw]) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [c, -s, 0, x, s, c, 0, y, 0, 0, 1, 0];
}

/** Turn about a unit axis. */
function turnAbout([x, y, z], angle) {
  const half = 0.5 * angle, s = Math.sin(half);
  return frameOf([0, 0, 0, x * s, y * s, z * s, Math.cos(half)]);
}

/** The frame of `b` seen through `a`. */
function compose(a, b) {
  const out = new Array(12);
  for (let row = 0; row < 12; row += 4) {
    for (let k = 0; k < 4; k += 1) {
      out[row + k] = a[row] * b[k] + a[row + 1] * b[4 + k] + a[row + 2] * b[8 + k] + (k === 3 ? a[row + 3] : 0);
    }
  }
  return out;
}

/** A point seen through a frame. */
function carry(f, [x, y, z]) {
  return [0, 4, 8].map((row) => f[row] * x + f[row + 1] * y + f[row + 2] * z + f[row + 3]);
}

/** A frame as a 4 x 4 matrix in columns. */
function matrixOf(f) {
  return [f[0], f[4], f[8], 0, f[1], f[5], f[9], 0, f[2], f[6], f[10], 0, f[3], f[7], f[11], 1];
}

/** Product of two 4 x 4 matrices in columns. */
function product(a, b) {
  const out = new Array(16);
  for (let c = 0; c < 4; c += 1) {
    for (let r = 0; r < 4; r += 1) {
      out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    }
  }
  return out;
}

/** Perspective with a vertical opening angle. */
function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(0.5 * angle);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

const minus = (a, b) => a.map((v, i) => v - b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };

/** Convex outline of points in the plane, counter-clockwise (Andrew's monotone chain). */
function outlineOf(points) {
  const sorted = points.map(([x, y]) => [x, y]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const left = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const chain = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length > 1 && left(out[out.length - 2], out[out.length - 1], p) <= 1e-12) out.pop();
      out.push(p);
    }
    out.pop();
    return out;
  };
  return [...chain(sorted), ...chain(sorted.reverse())];
}
