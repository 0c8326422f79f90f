// Where one looks from: a point on the floor, a distance and two angles.

const OPENING = 0.6; // vertical opening angle, rad

/** A camera that turns about a point. */
class Camera {
  constructor() {
    Object.assign(this, { target: [0, 0, 0], distance: 10, turn: 0, tilt: 0.9, aspect: 1 });
  }

  /** Unit vectors to the right, up on the screen, and back towards the eye. */
  axes() {
    const [ct, st, ci, si] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.tilt), Math.sin(this.tilt)];
    const back = [st * ci, -ct * ci, si];
    const right = [ct, st, 0];
    return { right, back, up: cross(back, right) };
  }

  /** Clip space from the map. */
  matrix() {
    const { right, up, back } = this.axes();
    const eye = this.target.map((v, i) => v + back[i] * this.distance);
    const view = [
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
    ];
    return product(perspective(OPENING, this.aspect, this.distance * 0.02, this.distance * 6 + 60), view);
  }

  /** Stands so that all points are in sight. */
  fit(points) {
    const low = [0, 1, 2].map((a) => Math.min(...points.map((p) => p[a])));
    const high = [0, 1, 2].map((a) => Math.max(...points.map((p) => p[a])));
    this.target = low.map((v, a) => 0.5 * (v + high[a]));
    let [near, far] = [0.1, 1e4];
    for (let i = 0; i < 40; i += 1) {
      this.distance = Math.sqrt(near * far);
      const inside = this.project(points).every(([x, y, w]) => w > 0 && Math.abs(x) < 0.93 && y < 0.8 && y > -0.93);
      if (inside) far = this.distance; else near = this.distance;
    }
    this.distance = far;
  }

  /** Places on the screen (-1 to 1, up and right positive), with what lies behind the eye not positive in the third. */
  project(points) {
    const m = this.matrix();
    return points.map(([x, y, z]) => {
      const w = m[3] * x + m[7] * y + m[11] * z + m[15];
      return [(m[0] * x + m[4] * y + m[8] * z + m[12]) / w, (m[1] * x + m[5] * y + m[9] * z + m[13]) / w, w];
    });
  }

  orbit(right, up) {
    this.turn += right;
    this.tilt = Math.max(0.08, Math.min(Math.PI / 2 - 1e-3, this.tilt + up));
  }

  zoom(factor) {
    this.distance = Math.max(0.4, Math.min(2000, this.distance * factor));
  }

  /** Moves along the floor by shares of the screen's height. */
  pan(right, up) {
    const span = 2 * this.distance * Math.tan(0.5 * OPENING);
    const [c, s] = [Math.cos(this.turn), Math.sin(this.turn)];
    this.target[0] += span * (right * c - up * s);
    this.target[1] += span * (right * s + up * c);
  }
}

/** Lets mouse, fingers and keys move a camera over a canvas; `moved` is called after each move. */
function steer(canvas, camera, moved, overview) {
  const fingers = new Map();
  const middle = () => {
    const all = [...fingers.values()];
    const [x, y] = [0, 1].map((a) => all.reduce((sum, p) => sum + p[a], 0) / all.length);
    return { x, y, spread: all.length > 1 ? Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) : 0 };
  };
  canvas.addEventListener('pointerdown', (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  canvas.addEventListener('pointermove', (e) => {
    if (!fingers.has(e.pointerId)) return;
    const before = middle();
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    const now = middle(), height = canvas.clientHeight;
    const [dx, dy] = [now.x - before.x, now.y - before.y];
    if (fingers.size > 1 || e.shiftKey || e.buttons > 1) {
      camera.pan(-dx / height, dy / height);
      if (before.spread > 0 && now.spread > 0) camera.zoom(before.spread / now.spread);
    } else {
      camera.orbit(-dx * 0.006, dy * 0.006);
    }
    moved();
  });
  const lift = (e) => fingers.delete(e.pointerId);
  canvas.addEventListener('pointerup', lift);
  canvas.addEventListener('pointercancel', lift);
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('wheel', (e) => {
    if (document.activeElement !== canvas && !e.ctrlKey) return; // the page scrolls
    e.preventDefault();
    camera.zoom(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.004));
    moved();
  }, { passive: false });
  canvas.addEventListener('keydown', (e) => {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (arrows && e.shiftKey) camera.pan(0.06 * arrows[0], 0.06 * arrows[1]);
    else if (arrows) camera.orbit(0.09 * arrows[0], 0.09 * arrows[1]);
    else if (e.key === '+' || e.key === '=') camera.zoom(0.85);
    else if (e.key === '-') camera.zoom(1 / 0.85);
    else if (e.key === 'Home') overview();
    else return;
    e.preventDefault();
    moved();
  });
}
